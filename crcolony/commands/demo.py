"""`crcolony demo`: evolve a colony for some seconds, then let its robots live as processes, with a dashboard."""

import argparse
from pathlib import Path

from crcolony.commands.options import (
    UsageError,
    add_config,
    add_examples,
    check_minutes,
    load_config,
    settings_of,
)


def add_demo(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony demo`."""
    add_config(parser)
    parser.add_argument("--robots", type=int, metavar="N", help="robots that evolve (default 4)")
    parser.add_argument(
        "-n", type=int, default=8, metavar="N", help="robots that live as processes (default 8)"
    )
    parser.add_argument(
        "--seconds", type=float, default=20.0, metavar="S", help="of evolution (default 20)"
    )
    parser.add_argument(
        "--minutes", type=float, metavar="M", help="stop after so many minutes of both together"
    )
    parser.add_argument(
        "--hz",
        type=float,
        default=10.0,
        metavar="H",
        help="control periods per second of the robots that live as processes (default 10)",
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="folder of both; default: the next free runs/N"
    )
    parser.add_argument("--no-dashboard", action="store_true", help="serve no dashboard")
    parser.set_defaults(command=_demo)
    add_examples(
        parser,
        ("crcolony demo", "twenty seconds of evolution, then eight robots until Ctrl-C"),
        ("crcolony demo --minutes 2 --out runs/first", "two minutes in all, into that folder"),
    )


def _demo(options: argparse.Namespace) -> int:
    check_minutes(options.minutes)
    if options.n < 1:
        raise UsageError(f"-n {options.n}: must be at least 1")
    if not 0.0 < options.seconds <= 86_400.0:
        raise UsageError(f"--seconds {options.seconds:g}: must be above 0 and at most a day")
    if not 0.001 <= options.hz <= 1000.0:
        raise UsageError(f"--hz {options.hz:g}: must be from 0.001 to 1000")
    import msgspec

    from crcolony.config import check_config, check_distributed
    from crcolony.demo.run_demo import DemoOptions, run_demo

    config = load_config(options.config, settings_of(options))
    live_config = msgspec.structs.replace(config, generations=0, robots=options.n)
    check_config(live_config, f"-n {options.n}")
    check_distributed(live_config)
    return run_demo(
        DemoOptions(
            config=config,
            live_config=live_config,
            folder=options.out,
            seconds=options.seconds,
            minutes=options.minutes,
            hz=options.hz,
            has_dashboard=not options.no_dashboard,
        )
    )
