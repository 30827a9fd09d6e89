"""`crcolony host`: run an arena and many robots in one process."""

import argparse
from pathlib import Path

from crcolony.commands.network_options import (
    add_clock,
    add_names,
    add_network,
    config_for_robots,
    network_of,
    wall_period_s,
)
from crcolony.commands.options import (
    add_config,
    new_folder,
    print_if_compiling,
)
from crcolony.errors import EXIT_OK


def add_host(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony host`."""
    add_config(parser)
    add_names(parser)
    parser.add_argument(
        "-n", type=int, default=20, metavar="N", help="robots in this process (default 20)"
    )
    parser.add_argument(
        "--robots", type=int, metavar="N", help="slots for bodies in the arena; default: -n plus 8"
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="results folder; default: the next free runs/N"
    )
    parser.add_argument("--minutes", type=float, metavar="M", help="stop after so many minutes")
    add_clock(parser)
    add_network(parser)
    parser.set_defaults(command=_host)


def _host(options: argparse.Namespace) -> int:
    from crcolony.runtime.start_host import HostOptions, run_host

    config = config_for_robots(options, spare_slots=8)
    period_s = wall_period_s(options, config.arena.control_period_s)
    network = network_of(options, listens_here=True)
    print_if_compiling()
    run_host(
        HostOptions(
            config=config,
            count=options.n,
            folder=options.out or new_folder(),
            colony=options.colony,
            arena=options.arena,
            network=network,
            wall_period_s=period_s,
            minutes=options.minutes,
        )
    )
    return EXIT_OK
