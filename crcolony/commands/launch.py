"""`crcolony launch`: start an arena and robots on this machine, each its own process."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from crcolony.commands.earlier_run import Start, add_from
from crcolony.commands.network_options import (
    add_clock,
    add_names,
    add_network,
    config_for_robots,
    network_of,
    wall_period_s,
)
from crcolony.commands.options import (
    UsageError,
    add_config,
    add_examples,
    add_log_format,
    add_no_plots,
)

if TYPE_CHECKING:
    from crcolony.runtime.forked_process import ForkServer


def add_launch(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony launch`."""
    add_config(parser)
    add_from(parser)
    add_names(parser)
    parser.add_argument(
        "-n",
        type=int,
        metavar="N",
        help="robots to start; default: as many as in --from or --out, or else 4",
    )
    parser.add_argument(
        "--robots", type=int, metavar="N", help="slots for bodies in the arena; default: -n"
    )
    parser.add_argument(
        "--robots-only", action="store_true", help="start no arena: join that of another machine"
    )
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="results folder, or that of a launch to go on with; default: the next free runs/N",
    )
    parser.add_argument("--minutes", type=float, metavar="M", help="stop after so many minutes")
    parser.add_argument(
        "--dashboard",
        action="store_true",
        help="serve a dashboard for browsers, and record it in DIR",
    )
    add_no_plots(parser)
    add_clock(parser)
    add_network(parser)
    add_log_format(parser, "colony", "arena")
    parser.set_defaults(command=_launch)
    add_examples(
        parser,
        ("crcolony launch", "four robots in lockstep, as fast as possible, until Ctrl-C"),
        (
            "crcolony launch -n 8 --hz 10 --dashboard",
            "eight in real time, with a dashboard for browsers",
        ),
        (
            "crcolony launch -n 2 --robots-only --connect tcp/10.0.0.1:7447 --open-network",
            "two robots for the arena of another machine",
        ),
    )


def _launch(options: argparse.Namespace) -> int:
    from crcolony.runtime.forked_process import ForkServer

    with ForkServer() as server:  # it gets ready meanwhile
        return _launch_from(server, options)


def _launch_from(server: "ForkServer", options: argparse.Namespace) -> int:
    from crcolony.results.colony_folder import open_colony_folder
    from crcolony.runtime.launch import run_launch
    from crcolony.runtime.launch_plan import LaunchOptions

    if options.credentials is not None:
        raise UsageError(
            "--credentials: every process of a deployment has its own; start them by themselves"
        )
    start = Start(options, "launch")
    config = config_for_robots(options, start, usual=4, spare_slots=0)
    if options.robots_only and (options.lockstep or options.hz or options.speed):
        raise UsageError("--robots-only: the arena determines the clock")
    is_lockstep = options.lockstep or not (options.hz or options.speed or options.robots_only)
    if config.robots > options.n and is_lockstep and not options.lockstep:
        is_lockstep = False  # robots of other machines are to join: lockstep would wait for them
    options.lockstep = is_lockstep
    network = None if _uses_defaults(options) else network_of(options)
    period_s = wall_period_s(options, config.arena.control_period_s)
    beginning = start.beginning(config, options.n)
    with open_colony_folder(options.out, "launch", config, beginning) as folder:
        launch = LaunchOptions(
            config=config,
            count=options.n,
            folder=folder.path,
            colony=options.colony,
            arena=options.arena,
            network=network,
            wall_period_s=period_s,
            robots_only=options.robots_only,
            minutes=options.minutes,
            has_dashboard=options.dashboard,
            has_plots=options.has_plots,
        )
        return run_launch(launch, folder, server)


def _uses_defaults(options: argparse.Namespace) -> bool:
    return not (options.connect or options.listen or options.interface or options.client)
