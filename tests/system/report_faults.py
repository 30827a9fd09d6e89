"""Prints how a colony on five hosts reacts to faults: `python -m tests.system.report_faults` (root; some six minutes).

Hosts are network namespaces on a switch: an arena, and four robots that mate several times a second. Printed are how
long after a fault a robot's token goes; how long after a cut of 8 s all are connected again, with bodies and no open
encounter (to 0.5 s, the period of telemetry); and, against the loss of packets both ways, the share of encounters in
which a robot was in doubt for a while, or gave its partner up.
"""

import argparse
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from tests.support.colony_in_namespaces import FAULTS, Cabled, cabled, detection_s, outcomes
from tests.support.mating_audit import check_ledger
from tests.support.namespaces import missing_requirement

SHARES = (0.0, 0.1, 0.2, 0.4)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=8, help="of every fault (default 8)")
    parser.add_argument("--seconds", type=float, default=30.0, help="at every loss (default 30)")
    options = parser.parse_args()
    if missing_requirement():
        sys.exit(missing_requirement())
    with tempfile.TemporaryDirectory() as folder, cabled(Path(folder)) as lan:
        lan.settle()
        print("| fault | offline after, s: median (least to most) |\n|---|---|")
        for fault in FAULTS:
            times = []
            for number in range(options.repeats):
                times.append(detection_s(lan, fault, number % len(lan.hosts)))
                lan.settle()
            print(
                f"| {fault.name} | {np.median(times):.2f} ({min(times):.2f} to {max(times):.2f}) |"
            )
        report_reconvergence(lan, options.repeats)
        report_loss(lan, options.seconds)
        lan.colony.finish(lan.view)
        print(f"in the end: {check_ledger(lan.colony.stores)}")


def report_reconvergence(lan: Cabled, repeats: int) -> None:
    """Cut all cables for 8 s, `repeats` times, and print how long it takes to settle."""
    times = []
    for _ in range(repeats):
        for host in lan.hosts:
            host.cut()
        time.sleep(8.0)
        for host in lan.hosts:
            host.mend()
        times.append(lan.settle())
    p50, p99 = np.quantile(times, (0.5, 0.99))
    print(f"\nsettled again after a cut of 8 s: p50 {p50:.1f} s, p99 {p99:.1f} s, {repeats} cuts\n")


def report_loss(lan: Cabled, seconds: float) -> None:
    """Lose packets both ways, and print the outcomes of encounters."""
    print(
        "| loss | matings a second | in doubt | orphaned | expired or refused | settled after, s |"
    )
    print("|---|---|---|---|---|---|")
    for share in SHARES:
        lan.lose(share, both_ways=True)
        counts = outcomes(lan, seconds)
        lan.lose(0.0, both_ways=True)
        settled_s = lan.settle()
        sides = counts["mated"] or 1
        print(
            f"| {share:.0%} | {counts['mated'] / 2 / seconds:.1f} | {counts['doubt'] / sides:.1%}"
            f" | {counts['orphaned'] / sides:.1%}"
            f" | {(counts['expired'] + counts['refused']) / sides:.1%} | {settled_s:.1f} |"
        )


if __name__ == "__main__":
    main()
