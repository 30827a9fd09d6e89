"""The commands that read or make files: check, plot, inspect, keygen."""

import argparse
from pathlib import Path

from crcolony.commands import UsageError
from crcolony.errors import EXIT_OK

_FORMATS = ("pdf", "svg", "png")


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
    parser.add_argument(
        "folders",
        type=Path,
        nargs="+",
        metavar="FOLDER",
        help="a run, or a comparison (evolve --seeds); of several runs those that differ only in seed belong together",
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="where the figures go; default: FOLDER/plots"
    )
    parser.add_argument(
        "--format",
        default="pdf,png",
        metavar="LIST",
        help=f"one or more of {', '.join(_FORMATS)}, separated by commas; default: pdf,png",
    )
    parser.set_defaults(command=_plot)


def _plot(options: argparse.Namespace) -> int:
    formats = [name.strip() for name in options.format.split(",")]
    unknown = [name for name in formats if name not in _FORMATS]
    if unknown:
        raise UsageError(
            f"--format {options.format}: {unknown[0]!r} is none of {', '.join(_FORMATS)}"
        )
    if options.out is None and len(options.folders) > 1:
        raise UsageError("several folders: say with --out where their figures go")
    from crcolony.colony.plots import draw_arms, read_arms

    arms = read_arms(options.folders)
    for arm in arms:
        print(arm.in_words())
    for path in draw_arms(arms, options.out or options.folders[0] / "plots", formats):
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
