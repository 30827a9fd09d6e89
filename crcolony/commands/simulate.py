"""`crcolony simulate`: run colonies in virtual time, with faults of network, disks and processes drawn by seed."""

import argparse

from crcolony.commands.options import UsageError, add_examples, print_if_compiling
from crcolony.errors import EXIT_OK, EXIT_VIOLATED

_MAX_ROBOTS = 50


def add_simulate(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony simulate`."""
    parser.add_argument(
        "--seeds", type=int, default=20, metavar="N", help="colonies to simulate (default 20)"
    )
    parser.add_argument(
        "--seed", type=int, default=1, metavar="N", help="seed of the first colony (default 1)"
    )
    parser.add_argument(
        "-n", "--robots", type=int, default=5, metavar="N", help="robots in each colony (default 5)"
    )
    parser.add_argument("--quiet", action="store_true", help="print only violations")
    parser.set_defaults(command=_simulate)
    add_examples(
        parser,
        (
            "crcolony simulate --seeds 200 --quiet",
            "two hundred colonies; only violations are printed",
        ),
        ("crcolony simulate --seed 17 --seeds 1", "one of them again"),
    )


def _simulate(options: argparse.Namespace) -> int:
    from collections import Counter

    from crcolony.fault_simulation.simulate import simulate

    if options.seeds < 1 or options.seed < 0:
        raise UsageError("--seeds must be at least 1, and --seed at least 0")
    if not 2 <= options.robots <= _MAX_ROBOTS:
        raise UsageError(f"--robots {options.robots}: must be from 2 to {_MAX_ROBOTS}")
    print_if_compiling()
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
    counts = ", ".join(f"{count} {name}" for name, count in totals.most_common())
    print(f"{options.seeds} colonies: {counts}")
    print(f"violations in seeds {violated}" if violated else "no violations")
    return EXIT_VIOLATED if violated else EXIT_OK
