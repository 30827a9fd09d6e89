"""`crcolony replay`: show a finished run in the dashboard."""

import argparse
from pathlib import Path

from crcolony.commands.options import UsageError, add_examples
from crcolony.errors import EXIT_OK


def add_replay(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony replay`."""
    parser.add_argument(
        "folder",
        type=Path,
        metavar="FOLDER",
        help="results folder of a run, or recording of a dashboard",
    )
    parser.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help="output file; default: FOLDER/replay.rrd, which is overwritten",
    )
    parser.add_argument(
        "--generations",
        default="",
        metavar="A,B,…",
        help="generations of an in-process run whose arena is shown; default: the first and the last",
    )
    parser.add_argument(
        "--seconds",
        type=float,
        default=120.0,
        metavar="S",
        help="simulated time to show of each of these generations (default 120)",
    )
    parser.add_argument(
        "--agent", default="", metavar="NAME", help="agent whose potentials are drawn"
    )
    parser.add_argument(
        "--native", action="store_true", help="open it in the native viewer of Rerun"
    )
    parser.set_defaults(command=_replay)
    add_examples(
        parser,
        ("crcolony replay runs/1 --native", "a run from its first generation to its last"),
        (
            "crcolony replay runs/1 --generations 0,100,249 --seconds 60",
            "a minute of the arena in each of three",
        ),
    )


def _replay(options: argparse.Namespace) -> int:
    from crcolony_dashboards.replay import run_replay

    from crcolony.recordings.resimulation import Windows

    if not 0.0 <= options.seconds < 1e9:
        raise UsageError(f"--seconds {options.seconds:g}: must be 0 or more")
    windows = Windows(_parse_generations(options.generations), options.seconds)
    run_replay(options.folder, options.out, windows, options.agent, options.native)
    return EXIT_OK


def _parse_generations(text: str) -> frozenset[int] | None:
    if not text:
        return None
    numbers = text.split(",")
    if not all(number.isascii() and number.isdigit() and len(number) < 8 for number in numbers):
        raise UsageError(f"--generations {text}: expected numbers, as in 0,10,249")
    return frozenset(map(int, numbers))
