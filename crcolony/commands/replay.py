"""`crcolony replay`: the dashboard of a run that is over."""

import argparse
from pathlib import Path

from crcolony.commands.options import UsageError
from crcolony.errors import EXIT_OK


def add_replay(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony replay`."""
    parser.add_argument(
        "folder", type=Path, metavar="FOLDER", help="of a run, or of a dashboard's recording"
    )
    parser.add_argument(
        "--out", type=Path, metavar="FILE", help="default: FOLDER/replay.rrd, written anew"
    )
    parser.add_argument(
        "--generations",
        default="",
        metavar="A,B,…",
        help="of an embedded run, those whose arena is shown; default: the first and the last",
    )
    parser.add_argument(
        "--seconds",
        type=float,
        default=120.0,
        metavar="S",
        help="of the colony's time to show of each of them (default 120)",
    )
    parser.add_argument("--agent", default="", metavar="NAME", help="whose potentials to draw")
    parser.add_argument("--native", action="store_true", help="open it in Rerun's own window")
    parser.set_defaults(command=_replay)


def _replay(options: argparse.Namespace) -> int:
    from crcolony_dashboards.replay import run_replay

    from crcolony.recordings.resimulation import Windows

    if not 0.0 <= options.seconds < 1e9:
        raise UsageError(f"--seconds {options.seconds:g}: 0 or more")
    windows = Windows(_generations(options.generations), options.seconds)
    run_replay(options.folder, options.out, windows, options.agent, options.native)
    return EXIT_OK


def _generations(text: str) -> frozenset[int] | None:
    if not text:
        return None
    numbers = text.split(",")
    if not all(number.isascii() and number.isdigit() and len(number) < 8 for number in numbers):
        raise UsageError(f"--generations {text}: expected numbers, as in 0,10,249")
    return frozenset(map(int, numbers))
