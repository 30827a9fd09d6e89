"""`crcolony check`: validate a config file."""

import argparse
from pathlib import Path

from crcolony.errors import EXIT_OK


def add_check(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony check`."""
    parser.add_argument("file", type=Path, metavar="FILE", help="TOML file with settings")
    parser.set_defaults(command=_check)


def _check(options: argparse.Namespace) -> int:
    from crcolony.config import load

    load(options.file)
    print(f"{options.file}: valid")
    return EXIT_OK
