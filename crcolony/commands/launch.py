"""`crcolony launch`: an arena and robots on this machine, each its own process."""

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
    UsageError,
    add_config,
    new_folder,
    say_if_compiling,
)

if TYPE_CHECKING:
    pass


def add_launch(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony launch`."""
    add_config(parser)
    _add_names(parser)
    parser.add_argument("-n", type=int, default=4, metavar="N", help="robots to start here")
    parser.add_argument("--robots", type=int, metavar="N", help="places in the arena; default: -n")
    parser.add_argument(
        "--robots-only", action="store_true", help="join the arena of another machine"
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="results folder")
    parser.add_argument("--minutes", type=float, metavar="M", help="stop after so long")
    parser.add_argument(
        "--dashboard", action="store_true", help="show it in a browser, and record it into DIR"
    )
    _add_clock(parser)
    add_network(parser)
    parser.set_defaults(command=_launch)


def _launch(options: argparse.Namespace) -> int:
    from crcolony.runtime.launch import run_launch
    from crcolony.runtime.launch_plan import LaunchOptions

    config = _config_of_many(options, spare_places=0)
    if options.robots_only and (options.lockstep or options.hz or options.speed):
        raise UsageError("--robots-only: the clock is the arena's")
    is_lockstep = options.lockstep or not (options.hz or options.speed or options.robots_only)
    if options.robots > options.n and is_lockstep and not options.lockstep:
        is_lockstep = False  # others are to join: nobody waits for them
    options.lockstep = is_lockstep
    say_if_compiling()
    return run_launch(
        LaunchOptions(
            config=config,
            count=options.n,
            folder=options.out or new_folder(),
            colony=options.colony,
            arena=options.arena,
            network=None if _is_bare(options) else network_of(options),
            wall_period_s=wall_period_s(options, config.arena.control_period_s),
            robots_only=options.robots_only,
            minutes=options.minutes,
            has_dashboard=options.dashboard,
        )
    )


def _is_bare(options: argparse.Namespace) -> bool:
    return not (options.connect or options.listen or options.interface or options.client)
