"""`crcolony arena`: run an arena that robots of any machine can join."""

import argparse
from pathlib import Path

from crcolony.commands.network_options import (
    NAME_RULE,
    add_clock,
    add_network,
    check_names,
    network_of,
    wall_period_s,
)
from crcolony.commands.options import (
    UsageError,
    add_config,
    add_examples,
    add_log_format,
    load_config,
    settings_of,
)
from crcolony.errors import EXIT_OK


def add_arena(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony arena`."""
    add_config(parser)
    parser.add_argument("--robots", type=int, metavar="N", help="slots for bodies (default 4)")
    parser.add_argument("--arena", default="arena", metavar="NAME", help=f"name: {NAME_RULE}")
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="folder for the arena's checkpoint; default: none is written",
    )
    parser.add_argument(
        "--expect",
        type=int,
        default=1,
        metavar="N",
        help="robots to wait for before lockstep starts (default 1)",
    )
    add_clock(parser)
    add_network(parser)
    add_log_format(parser, "arena")
    parser.set_defaults(command=_arena, colony="colony")
    add_examples(
        parser,
        (
            "crcolony arena --robots 4 --listen tls/10.0.0.1:7447 --out runs/arena --credentials main",
            "for robots of other machines",
        ),
        (
            "crcolony arena --robots 2 --lockstep --expect 2",
            "as fast as possible, once two robots have joined",
        ),
    )


def _arena(options: argparse.Namespace) -> int:
    from crcolony.runtime.service_notify import service_notifier
    from crcolony.runtime.start_arena import run_arena

    check_names(options)
    config = load_config(options.config, settings_of(options))
    if not 1 <= options.expect <= config.robots:
        raise UsageError(
            f"--expect {options.expect}: from 1 to {config.robots}, the slots of the arena (--robots)"
        )
    period_s = wall_period_s(options, config.arena.control_period_s)
    network = network_of(options, listens_here=True)
    run_arena(
        config, options.arena, network, period_s, options.expect, options.out, service_notifier()
    )
    return EXIT_OK
