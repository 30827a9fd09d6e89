"""`crcolony inspect`: print what is in a robot's file, or in a results folder."""

import argparse
from pathlib import Path

from crcolony.commands.options import UsageError, add_examples
from crcolony.errors import EXIT_OK


def add_inspect(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony inspect`."""
    parser.add_argument(
        "path",
        type=Path,
        metavar="FILE|FOLDER",
        help="a robot's file or folder, or the results folder of evolve, launch or host",
    )
    parser.add_argument(
        "--csv",
        choices=("matings", "births", "lives", "pool"),
        help="print one table of a robot's file as comma-separated values",
    )
    parser.set_defaults(command=_inspect)
    add_examples(
        parser,
        ("crcolony inspect runs/1", "what is there, robot by robot"),
        ("crcolony inspect runs/1/robots/0", "one robot: lineage, offspring pool, matings"),
        ("crcolony inspect runs/1/robots/0 --csv matings", "its matings, for a spreadsheet"),
    )


def _inspect(options: argparse.Namespace) -> int:
    from crcolony.results.inspect_folder import inspect_folder
    from crcolony.results.inspect_robot import inspect_robot
    from crcolony.storage.files import ROBOT_FILE, existing_robot_file

    path: Path = options.path
    if path.is_dir() and (own := existing_robot_file(path / ROBOT_FILE)).exists():
        path = own
    if not path.is_dir():
        inspect_robot(path, options.csv)
    elif options.csv is None:
        inspect_folder(path)
    else:
        raise UsageError(f"--csv needs a robot's file, as in {path / 'robots' / '0'}")
    return EXIT_OK
