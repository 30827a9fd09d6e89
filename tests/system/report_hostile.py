"""Prints how a colony performs under every attack: `python -m tests.system.report_hostile [SECONDS] [ATTACK ...]`.

The matings during an attack are compared with those before and after it, over the same time: their rate, which depends
on chance and evolution, and their share of the encounters, which does not.
"""

import sys
import tempfile
from pathlib import Path

from tests.support.attack import HZ, ROBOTS, Figures, siege
from tests.support.hostile_peer import ATTACKS

SECONDS = 15.0


def format_line(name: str, figures: Figures, rate: str = "") -> str:
    """Return the measurements as one line."""
    half, most = figures.period_ms
    return (
        f"{name:14} {figures.matings_per_s:5.1f} matings/s {rate:6} {figures.mated_share:4.0%} of encounters"
        f"  period {half:5.1f} ms, p99 {most:6.1f} ms  grown {figures.grown_mib:+5.1f} MiB"
    )


def main() -> None:
    """Measure and print."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else SECONDS
    print(f"{ROBOTS} robots at {HZ:g} Hz, {seconds:g} s each")
    with tempfile.TemporaryDirectory() as folder, siege(Path(folder)) as besieged:
        before = besieged.monitor(seconds)
        print(format_line("calm", before), flush=True)
        for attack in sys.argv[2:] or ATTACKS:
            with besieged.attacked(attack):
                during = besieged.monitor(seconds)
            after = besieged.monitor(seconds)
            calm = (before.matings_per_s + after.matings_per_s) / 2.0
            print(format_line(attack, during, f"{during.matings_per_s / calm:.0%}"), flush=True)
            print(format_line("calm", after), flush=True)
            before = after


if __name__ == "__main__":
    main()
