"""`crcolony keygen`: generate a robot's key."""

import argparse
from pathlib import Path

from crcolony.errors import EXIT_OK


def add_keygen(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony keygen`."""
    parser.add_argument(
        "file", type=Path, metavar="FILE", help="file for the secret key; must not exist yet"
    )
    parser.set_defaults(command=_keygen)


def _keygen(options: argparse.Namespace) -> int:
    from crcolony.protocol.identity import create_key

    identity = create_key(options.file)
    print(f"{options.file}: the secret key of robot {identity.id.hex()}")
    return EXIT_OK
