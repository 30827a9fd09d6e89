"""`crcolony inspect`: print what is in a robot's file."""

import argparse
from pathlib import Path

from crcolony.errors import EXIT_OK


def add_inspect(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony inspect`."""
    parser.add_argument("file", type=Path, metavar="FILE", help="robot.sqlite in a robot's folder")
    parser.add_argument(
        "--csv",
        choices=("matings", "births", "lives", "pool"),
        help="print one table as comma-separated values",
    )
    parser.set_defaults(command=_inspect)


def _inspect(options: argparse.Namespace) -> int:
    from crcolony.results.inspect_robot import inspect_robot

    inspect_robot(options.file, options.csv)
    return EXIT_OK
