"""The commands that look at a running colony: top and status."""

import argparse

from crcolony.commands import UsageError
from crcolony.commands.network import add_network, network_of
from crcolony.errors import EXIT_OK


def add_top(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony top`."""
    parser.add_argument("--colony", default="*", metavar="NAME", help="default: every colony")
    parser.add_argument("--seconds", type=float, metavar="S", help="stop after so long")
    add_network(parser)
    parser.set_defaults(command=_top)


def _top(options: argparse.Namespace) -> int:
    from crcolony.colony.processes.top import run_top

    if options.seconds is not None and not 0.0 < options.seconds < 1e9:
        raise UsageError(f"--seconds {options.seconds:g}: must be above 0")
    return run_top(network_of(options), options.colony, options.seconds)


def add_status(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony status`."""
    parser.add_argument("--colony", default="*", metavar="NAME", help="default: every colony")
    parser.add_argument("--json", action="store_true", help="for programs")
    parser.add_argument(
        "--seconds", type=float, default=1.5, metavar="S", help="listen for so long (default 1.5)"
    )
    add_network(parser)
    parser.set_defaults(command=_status)


def _status(options: argparse.Namespace) -> int:
    from crcolony.colony.processes.top import run_status

    if not 0.0 < options.seconds <= 600.0:
        raise UsageError(f"--seconds {options.seconds:g}: from 0 to 600")
    run_status(network_of(options), options.colony, options.seconds, options.json)
    return EXIT_OK
