"""The commands that read or make files: check, plot, inspect, keygen."""

import argparse
from pathlib import Path

from crcolony.errors import EXIT_OK


def add_check(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony check`."""
    parser.add_argument("file", type=Path, metavar="FILE")
    parser.set_defaults(command=_check)


def _check(options: argparse.Namespace) -> int:
    from crcolony.config import load

    load(options.file)
    print(f"{options.file}: good")
    return EXIT_OK


def add_plot(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony plot`."""
    parser.add_argument("folder", type=Path, metavar="FOLDER")
    parser.set_defaults(command=_plot)


def _plot(options: argparse.Namespace) -> int:
    from crcolony.colony.plots import draw_plots

    for path in draw_plots(options.folder):
        print(path)
    return EXIT_OK


def add_keygen(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony keygen`."""
    parser.add_argument("file", type=Path, metavar="FILE", help="the secret key; must not exist")
    parser.set_defaults(command=_keygen)


def _keygen(options: argparse.Namespace) -> int:
    from crcolony.colony.identity import create_key

    identity = create_key(options.file)
    print(f"{options.file}: the secret key of robot {identity.id.hex()}")
    return EXIT_OK


def add_inspect(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony inspect`."""
    parser.add_argument("file", type=Path, metavar="FILE", help="a robot's memory.sqlite")
    parser.add_argument(
        "--csv",
        choices=("matings", "births", "lives", "pool"),
        help="one table as comma-separated values",
    )
    parser.set_defaults(command=_inspect)


def _inspect(options: argparse.Namespace) -> int:
    from crcolony.colony.memory.inspecting import inspect_memory

    inspect_memory(options.file, options.csv)
    return EXIT_OK
