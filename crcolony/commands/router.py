"""`crcolony router`: a Zenoh router for colonies larger than a mesh carries."""

import argparse
from typing import TYPE_CHECKING

from crcolony.commands.network_options import add_network, network_of
from crcolony.commands.options import (
    UsageError,
)
from crcolony.errors import EXIT_OK

if TYPE_CHECKING:
    pass


def add_router(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony router`."""
    add_network(parser)
    parser.set_defaults(command=_router)


def _router(options: argparse.Namespace) -> int:
    import msgspec

    from crcolony.runtime.start_arena import run_router

    if options.client:
        raise UsageError("a router is no client")
    network = msgspec.structs.replace(network_of(options, listens_here=True), role="router")
    run_router(network)
    return EXIT_OK
