"""`crcolony inspect`: what is stored in a robot's file."""

import argparse
from pathlib import Path

from crcolony.errors import EXIT_OK


def add_inspect(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony inspect`."""
    parser.add_argument("file", type=Path, metavar="FILE", help="a robot's robot.sqlite")
    parser.add_argument(
        "--csv",
        choices=("matings", "births", "lives", "pool"),
        help="one table as comma-separated values",
    )
    parser.set_defaults(command=_inspect)


def _inspect(options: argparse.Namespace) -> int:
    from crcolony.results.inspect_robot import inspect_memory

    inspect_memory(options.file, options.csv)
    return EXIT_OK
