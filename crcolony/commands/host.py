"""`crcolony host`: run an arena and many robots in one process."""

import argparse
from pathlib import Path

from crcolony.commands.earlier_run import Start, add_from
from crcolony.commands.network_options import (
    add_clock,
    add_names,
    add_network,
    config_for_robots,
    network_of,
    wall_period_s,
)
from crcolony.commands.options import add_config, add_examples, add_log_format, add_no_plots
from crcolony.errors import EXIT_OK


def add_host(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony host`."""
    add_config(parser)
    add_from(parser)
    add_names(parser)
    parser.add_argument(
        "-n",
        type=int,
        metavar="N",
        help="robots in this process; default: as many as in --from or --out, or else 20",
    )
    parser.add_argument(
        "--robots", type=int, metavar="N", help="slots for bodies in the arena; default: -n plus 8"
    )
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="results folder, or that of a host to go on with; default: the next free runs/N",
    )
    parser.add_argument("--minutes", type=float, metavar="M", help="stop after so many minutes")
    add_no_plots(parser)
    add_clock(parser)
    add_network(parser)
    add_log_format(parser, "colony", "arena")
    parser.set_defaults(command=_host)
    add_examples(
        parser,
        ("crcolony host -n 200 --minutes 10", "two hundred robots in one process, in real time"),
        ("crcolony host -n 20 --lockstep --generations 50", "as fast as possible"),
    )


def _host(options: argparse.Namespace) -> int:
    from crcolony.results.colony_folder import open_colony_folder
    from crcolony.runtime.service_notify import service_notifier
    from crcolony.runtime.start_host import HostOptions, run_host

    start = Start(options, "host")
    config = config_for_robots(options, start, usual=20, spare_slots=8)
    period_s = wall_period_s(options, config.arena.control_period_s)
    network = network_of(options, listens_here=True)
    beginning = start.beginning(config, options.n)
    with open_colony_folder(options.out, "host", config, beginning) as folder:
        host = HostOptions(
            config=config,
            count=options.n,
            colony=options.colony,
            arena=options.arena,
            network=network,
            wall_period_s=period_s,
            minutes=options.minutes,
            has_plots=options.has_plots,
        )
        run_host(host, folder, service_notifier())
    return EXIT_OK
