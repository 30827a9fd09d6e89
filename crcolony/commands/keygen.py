"""`crcolony keygen`: generate a robot's key."""

import argparse
import sys
from pathlib import Path

from crcolony.commands.options import add_examples
from crcolony.errors import EXIT_OK


def add_keygen(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony keygen`."""
    parser.add_argument(
        "file", type=Path, metavar="FILE", help="file for the secret key; must not exist yet"
    )
    parser.set_defaults(command=_keygen)
    add_examples(
        parser,
        ("crcolony keygen runs/robot/key", "the key that crcolony robot --out runs/robot will use"),
    )


def _keygen(options: argparse.Namespace) -> int:
    from crcolony.protocol.identity import create_key, key_warning

    identity = create_key(options.file)
    print(f"{options.file}: the secret key of robot {identity.id.hex()}")
    if warning := key_warning(options.file):
        print(f"crcolony: {warning}", file=sys.stderr)
    return EXIT_OK
