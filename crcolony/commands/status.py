"""`crcolony status`: print the robots that are online and their state, once."""

import argparse

from crcolony.commands.network_options import add_network, network_of
from crcolony.commands.options import UsageError, add_examples
from crcolony.errors import EXIT_OK


def add_status(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony status`."""
    parser.add_argument("--colony", default="*", metavar="NAME", help="name; default: all colonies")
    parser.add_argument("--json", action="store_true", help="print JSON, for programs")
    parser.add_argument(
        "--seconds", type=float, default=1.5, metavar="S", help="time to listen (default 1.5)"
    )
    add_network(parser)
    parser.set_defaults(command=_status)
    add_examples(
        parser,
        ("crcolony status", "the robots of this machine"),
        (
            "crcolony status --json --connect tls/10.0.0.1:7447 --credentials wall",
            "those of another machine, for programs",
        ),
    )


def _status(options: argparse.Namespace) -> int:
    from crcolony.telemetry.terminal_view import run_status

    if not 0.0 < options.seconds <= 600.0:
        raise UsageError(f"--seconds {options.seconds:g}: must be above 0 and at most 600")
    run_status(network_of(options), options.colony, options.seconds, options.json)
    return EXIT_OK
