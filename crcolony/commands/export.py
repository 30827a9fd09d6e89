"""`crcolony export`: export recorded telemetry as Parquet tables, and a run's lineage in the ALife data standard."""

import argparse
import sys
from pathlib import Path

from crcolony.commands.options import add_examples
from crcolony.errors import EXIT_OK


def add_export(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony export`."""
    parser.add_argument(
        "folder",
        type=Path,
        metavar="FOLDER",
        help="results folder of a run, or recording of a dashboard",
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="output folder; default: FOLDER/parquet"
    )
    parser.set_defaults(command=_export)
    add_examples(
        parser,
        ("crcolony export runs/1", "into runs/1/parquet"),
    )


def _export(options: argparse.Namespace) -> int:
    from crcolony.recordings.export import export
    from crcolony.recordings.lineage import write_lineage
    from crcolony.results.history_database import HISTORY_DATABASE
    from crcolony.storage.claimed_folder import check_output_folder

    folder = options.folder if options.folder.is_dir() else options.folder.parent
    if options.out is not None:
        check_output_folder(options.out)
    out = options.out or folder / "parquet"
    for path in export(options.folder, out, print_line=_print_warning):
        print(path)
    if (options.folder / HISTORY_DATABASE).is_file():
        print(write_lineage(options.folder / HISTORY_DATABASE, out))
    return EXIT_OK


def _print_warning(line: str) -> None:
    print(f"crcolony: {line}", file=sys.stderr)
