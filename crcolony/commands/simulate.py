"""`crcolony simulate`: whole colonies in virtual time, on a network and on disks that fail by seed."""

import argparse

from crcolony.commands.options import UsageError, say_if_compiling
from crcolony.errors import EXIT_OK, EXIT_VIOLATED

_MAX_ROBOTS = 50


def add_simulate(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony simulate`."""
    parser.add_argument("--seeds", type=int, default=20, metavar="N", help="so many colonies")
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="the first of them")
    parser.add_argument("--robots", type=int, default=5, metavar="N", help="in each (default 5)")
    parser.add_argument("--quiet", action="store_true", help="say only what is violated")
    parser.set_defaults(command=_simulate)


def _simulate(options: argparse.Namespace) -> int:
    from collections import Counter

    from crcolony.fault_simulation.simulate import simulate

    if options.seeds < 1 or options.seed < 0:
        raise UsageError("--seeds must be at least 1, and --seed at least 0")
    if not 2 <= options.robots <= _MAX_ROBOTS:
        raise UsageError(f"--robots {options.robots}: from 2 to {_MAX_ROBOTS}")
    say_if_compiling()
    totals: Counter[str] = Counter()
    violated = []
    for seed in range(options.seed, options.seed + options.seeds):
        report = simulate(seed, options.robots)
        totals += report.counts + Counter(
            {"matings": report.matings, "conceptions": report.conceptions}
        )
        if report.violations:
            violated.append(seed)
        if report.violations or not options.quiet:
            print(report, flush=True)
    said = ", ".join(f"{count} {name}" for name, count in totals.most_common())
    print(f"{options.seeds} colonies: {said}")
    print(f"violations in seeds {violated}" if violated else "no promise was broken")
    return EXIT_VIOLATED if violated else EXIT_OK
