"""`crcolony robot`: run one robot."""

import argparse
from pathlib import Path

from crcolony.commands.earlier_run import Start, add_from
from crcolony.commands.network_options import (
    add_names,
    add_network,
    add_no_shared_memory,
    check_names,
    network_of,
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


def add_robot(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony robot`."""
    add_config(parser)
    add_from(parser)
    add_names(parser)
    parser.add_argument(
        "--key",
        type=Path,
        metavar="FILE",
        help="its secret key; default: DIR/key, generated if missing",
    )
    parser.add_argument(
        "--number", type=int, default=-1, metavar="N", help="slot of the arena that it asks for"
    )
    parser.add_argument(
        "--repeatable",
        action="store_true",
        help="derive random numbers from the config's seed and --number, not from its id",
    )
    parser.add_argument(
        "--allow",
        type=Path,
        metavar="FILE",
        help="file with the ids of the robots that it may mate with; default: all",
    )
    parser.add_argument(
        "--out", type=Path, required=True, metavar="DIR", help="folder for its key and its file"
    )
    parser.add_argument(
        "--snapshot",
        type=float,
        default=10.0,
        metavar="SECONDS",
        help="time between two snapshots (default 10)",
    )
    add_network(parser)
    add_no_shared_memory(parser)
    add_log_format(parser, "colony", "arena")
    parser.set_defaults(command=_robot)
    add_examples(
        parser,
        ("crcolony robot --out runs/robot", "in the arena of this machine"),
        (
            "crcolony robot --out runs/robot --connect tls/10.0.0.1:7447 --credentials kitchen",
            "in the arena of another machine",
        ),
    )


def _robot(options: argparse.Namespace) -> int:
    from crcolony.config import check_distributed
    from crcolony.runtime.service_notify import service_notifier
    from crcolony.runtime.start_robot import RobotOptions, run_robot

    check_names(options)
    if options.repeatable and options.number < 0:
        raise UsageError("--repeatable needs --number")
    if not 0.1 <= options.snapshot <= 86_400:
        raise UsageError(f"--snapshot {options.snapshot:g}: must be from 0.1 to 86400 seconds")
    start = Start(options, "robot")
    config = load_config(start.config_file(options), settings_of(options))
    check_distributed(config)
    network = network_of(options)
    run_robot(
        RobotOptions(
            config=config,
            folder=options.out,
            colony=options.colony,
            arena=options.arena,
            network=network,
            key=options.key,
            number=options.number,
            is_repeatable=options.repeatable,
            allow=options.allow,
            shares_memory=not options.no_shared_memory,
            snapshot_s=options.snapshot,
            beginning=start.beginning(config, 1),
        ),
        service_notifier(),
    )
    return EXIT_OK
