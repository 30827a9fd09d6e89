"""`crcolony plot`: draw the figures of one run or of many."""

import argparse
from pathlib import Path

from crcolony.commands.options import UsageError, add_examples
from crcolony.errors import EXIT_OK

_FORMATS = ("pdf", "svg", "png")


def add_plot(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony plot`."""
    parser.add_argument(
        "folders",
        type=Path,
        nargs="+",
        metavar="FOLDER",
        help="a run, or a comparison (evolve --seeds); runs that differ only in their seed are averaged",
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="folder for the figures; default: FOLDER/plots"
    )
    parser.add_argument(
        "--format",
        default="pdf,png",
        metavar="LIST",
        help=f"one or more of {', '.join(_FORMATS)}, separated by commas; default: pdf,png",
    )
    parser.set_defaults(command=_plot)
    add_examples(
        parser,
        ("crcolony plot runs/1", "into runs/1/plots, as PDF and PNG"),
        (
            "crcolony plot runs/a runs/b --out figures --format svg",
            "several runs; those that differ by seed are averaged",
        ),
    )


def _plot(options: argparse.Namespace) -> int:
    formats = [name.strip() for name in options.format.split(",")]
    unknown = [name for name in formats if name not in _FORMATS]
    if unknown:
        raise UsageError(
            f"--format {options.format}: {unknown[0]!r} is not one of {', '.join(_FORMATS)}"
        )
    if options.out is None and len(options.folders) > 1:
        raise UsageError("several folders: --out is needed, the folder for the figures")
    from crcolony.results.plots import draw_conditions
    from crcolony.results.plots.conditions import read_conditions
    from crcolony.storage.claimed_folder import check_output_folder

    if options.out is not None:
        check_output_folder(options.out)
    conditions = read_conditions(options.folders)
    for condition in conditions:
        print(condition.describe())
    for path in draw_conditions(conditions, options.out or options.folders[0] / "plots", formats):
        print(path)
    return EXIT_OK
