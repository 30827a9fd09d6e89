"""`crcolony check`: validate a config file."""

import argparse
from pathlib import Path

from crcolony.commands.options import add_examples, load_config
from crcolony.errors import EXIT_OK


def add_check(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony check`."""
    parser.add_argument("file", type=Path, metavar="FILE", help="TOML file with settings")
    parser.set_defaults(command=_check)
    add_examples(
        parser,
        ("crcolony check my.toml", "says what is wrong with it, or that it is valid"),
    )


def _check(options: argparse.Namespace) -> int:
    load_config(options.file, ())
    print(f"{options.file}: valid")
    return EXIT_OK
