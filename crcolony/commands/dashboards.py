"""The commands that show colonies in Rerun: dashboard, replay, and export of what was recorded."""

import argparse
import sys
from pathlib import Path

from crcolony.commands import UsageError, check_minutes, new_folder
from crcolony.commands.network import add_network, network_of
from crcolony.errors import EXIT_OK


def add_dashboard(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony dashboard`."""
    from crcolony.dashboards.ports import LIVE_PORT, WEB_PORT

    parser.add_argument("--colony", default="*", metavar="NAME", help="default: every colony")
    parser.add_argument(
        "--agent", default="", metavar="NAME", help="whose potentials to draw; default: the best's"
    )
    show = parser.add_argument_group("viewers", "without these, open the address that is printed")
    show.add_argument("--web", action="store_true", help="for a browser of this machine")
    show.add_argument("--native", action="store_true", help="open Rerun's own window")
    show.add_argument(
        "--port",
        type=int,
        default=LIVE_PORT,
        metavar="P",
        help=f"for viewers (default {LIVE_PORT})",
    )
    show.add_argument(
        "--web-port", type=int, default=WEB_PORT, metavar="P", help=f"of --web (default {WEB_PORT})"
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="record there; default: runs/N, the next free one"
    )
    parser.add_argument("--no-recording", action="store_true", help="record nothing")
    parser.add_argument("--minutes", type=float, metavar="M", help="stop after so long")
    add_network(parser)
    parser.set_defaults(command=_dashboard)


def _dashboard(options: argparse.Namespace) -> int:
    for name, port in (("--port", options.port), ("--web-port", options.web_port)):
        if not 0 < port < 65536:
            raise UsageError(f"{name} {port}: from 1 to 65535")
    check_minutes(options.minutes)
    if options.no_recording and options.out is not None:
        raise UsageError("--no-recording does not go with --out")
    from crcolony.dashboards.live import Watching, run_dashboard

    run_dashboard(
        Watching(
            network=network_of(options),
            colony=options.colony,
            port=options.port,
            folder=None if options.no_recording else options.out or new_folder(),
            web_port=options.web_port if options.web else None,
            native=options.native,
            agent=options.agent,
            minutes=options.minutes,
        )
    )
    return EXIT_OK


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
    from crcolony.dashboards.recordings.resimulation import Windows
    from crcolony.dashboards.replay import run_replay

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


def add_export(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony export`."""
    parser.add_argument(
        "folder", type=Path, metavar="FOLDER", help="of a run, or of a dashboard's recording"
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="default: FOLDER/parquet")
    parser.set_defaults(command=_export)


def _export(options: argparse.Namespace) -> int:
    from crcolony.dashboards.recordings.export import export

    folder = options.folder if options.folder.is_dir() else options.folder.parent
    for path in export(options.folder, options.out or folder / "parquet", say=_warn):
        print(path)
    return EXIT_OK


def _warn(line: str) -> None:
    print(f"crcolony: {line}", file=sys.stderr)
