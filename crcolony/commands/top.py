"""`crcolony top`: show the robots that are online and their state, live."""

import argparse

from crcolony.commands.network_options import add_network, network_of
from crcolony.commands.options import UsageError, add_examples


def add_top(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony top`."""
    parser.add_argument("--colony", default="*", metavar="NAME", help="name; default: all colonies")
    parser.add_argument("--seconds", type=float, metavar="S", help="stop after so many seconds")
    add_network(parser)
    parser.set_defaults(command=_top)
    add_examples(
        parser,
        ("crcolony top", "the colonies of this machine"),
        (
            "crcolony top --connect tls/10.0.0.1:7447 --credentials wall",
            "the colony of a deployment",
        ),
    )


def _top(options: argparse.Namespace) -> int:
    from crcolony.telemetry.terminal_view import run_top

    if options.seconds is not None and not 0.0 < options.seconds < 1e9:
        raise UsageError(f"--seconds {options.seconds:g}: must be above 0")
    return run_top(network_of(options), options.colony, options.seconds)
