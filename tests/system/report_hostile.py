"""How a colony fares under every attack: `python -m tests.system.report_hostile [SECONDS] [ATTACK ...]`.

A calm while before and after every attack, as long as the attack itself, is what its matings are compared with: their
rate, which depends on whom chance and evolution bring together, and their share of the encounters, which does not.
"""

import sys
import tempfile
from pathlib import Path

from tests.support.attack import HZ, ROBOTS, Figures, siege
from tests.support.hostile_peer import ATTACKS

SECONDS = 15.0


def line(name: str, figures: Figures, rate: str = "") -> str:
    half, most = figures.period_ms
    return (
        f"{name:14} {figures.matings_per_s:5.1f} matings/s {rate:6} {figures.mated_share:4.0%} of encounters"
        f"  period {half:5.1f} ms, p99 {most:6.1f} ms  grown {figures.grown_mib:+5.1f} MiB"
    )


def main() -> None:
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else SECONDS
    print(f"{ROBOTS} robots at {HZ:g} Hz, {seconds:g} s each")
    with tempfile.TemporaryDirectory() as folder, siege(Path(folder)) as besieged:
        before = besieged.monitor(seconds)
        print(line("calm", before), flush=True)
        for attack in sys.argv[2:] or ATTACKS:
            with besieged.attacked(attack):
                during = besieged.monitor(seconds)
            after = besieged.monitor(seconds)
            calm = (before.matings_per_s + after.matings_per_s) / 2.0
            print(line(attack, during, f"{during.matings_per_s / calm:.0%}"), flush=True)
            print(line("calm", after), flush=True)
            before = after


if __name__ == "__main__":
    main()
