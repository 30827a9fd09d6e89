"""`crcolony router`: run a Zenoh router, for colonies too large for a mesh of peers."""

import argparse

from crcolony.commands.network_options import add_network, network_of
from crcolony.commands.options import UsageError, add_examples, add_log_format
from crcolony.errors import EXIT_OK


def add_router(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony router`."""
    parser.add_argument(
        "--print-config",
        action="store_true",
        help="print Zenoh's configuration, for a router of another make (zenohd), and exit",
    )
    add_network(parser)
    add_log_format(parser)
    parser.set_defaults(command=_router)
    add_examples(
        parser,
        (
            "crcolony router --listen tls/10.0.0.1:7447 --credentials north",
            "for robots with --client --connect tls/10.0.0.1:7447",
        ),
    )


def _router(options: argparse.Namespace) -> int:
    import msgspec

    from crcolony.runtime.service_notify import service_notifier
    from crcolony.runtime.start_arena import run_router
    from crcolony.transport.zenoh_config import print_config

    if options.client:
        raise UsageError("--client cannot be used with a router")
    network = msgspec.structs.replace(network_of(options, listens_here=True), role="router")
    if options.print_config:
        print_config(network)
    else:
        run_router(network, service_notifier())
    return EXIT_OK
