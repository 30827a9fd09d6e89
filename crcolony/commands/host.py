"""`crcolony host`: an arena and many robots in one process."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from crcolony.commands.network_options import (
    _add_clock,
    _add_names,
    _config_of_many,
    add_network,
    network_of,
    wall_period_s,
)
from crcolony.commands.options import (
    add_config,
    new_folder,
    say_if_compiling,
)
from crcolony.errors import EXIT_OK

if TYPE_CHECKING:
    pass


def add_host(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony host`."""
    add_config(parser)
    _add_names(parser)
    parser.add_argument("-n", type=int, default=20, metavar="N", help="robots in this process")
    parser.add_argument("--robots", type=int, metavar="N", help="places for bodies; default: N + 8")
    parser.add_argument("--out", type=Path, metavar="DIR", help="their memories")
    parser.add_argument("--minutes", type=float, metavar="M", help="stop after so long")
    _add_clock(parser)
    add_network(parser)
    parser.set_defaults(command=_host)


def _host(options: argparse.Namespace) -> int:
    from crcolony.runtime.start_host import HostOptions, run_host

    config = _config_of_many(options, spare_places=8)
    period_s = wall_period_s(options, config.arena.control_period_s)
    network = network_of(options, listens_here=True)
    say_if_compiling()
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
