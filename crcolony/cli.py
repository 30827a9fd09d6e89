"""The command line. Heavy imports wait until a command needs them, so that `--help` answers at once."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

_EXIT_OK, _EXIT_WRONG_INPUT, _EXIT_INTERRUPTED = 0, 2, 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; return its exit code: 0 done, 2 wrong input (said in one line), 130 interrupted twice."""
    options = _parser().parse_args(arguments)
    from crcolony.colony.results import ResultsError
    from crcolony.config import ConfigError

    try:
        code: int = options.command(options)
    except (ConfigError, ResultsError, UsageError) as error:
        print(f"crcolony: {error}", file=sys.stderr)
        return _EXIT_WRONG_INPUT
    except KeyboardInterrupt:
        print("crcolony: interrupted", file=sys.stderr)
        return _EXIT_INTERRUPTED
    return code


class UsageError(Exception):
    """Options that do not go together."""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="crcolony",
        description="A colony of robots that evolves how to learn, with nobody in charge.",
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    _add_evolve(commands.add_parser("evolve", help="evolve an embedded colony on this machine"))
    check = commands.add_parser("check", help="validate a config file")
    check.add_argument("file", type=Path, metavar="FILE")
    check.set_defaults(command=_check)
    plot = commands.add_parser("plot", help="draw the plots of a results folder again")
    plot.add_argument("folder", type=Path, metavar="FOLDER")
    plot.set_defaults(command=_plot)
    return parser


def _add_evolve(evolve: argparse.ArgumentParser) -> None:
    evolve.add_argument("--config", type=Path, metavar="FILE", help="TOML file; default: built in")
    evolve.add_argument("--robots", type=int, metavar="N")
    evolve.add_argument("--generations", type=int, metavar="N")
    evolve.add_argument("--seed", type=int, metavar="N")
    evolve.add_argument(
        "--selection", choices=("implicit", "central"), help="central: the baseline to compare with"
    )
    evolve.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        dest="settings",
        help="any setting of the config, as in --set life.agents=10; may be repeated",
    )
    evolve.add_argument("--out", type=Path, metavar="DIR", help="results folder")
    evolve.add_argument("--resume", action="store_true", help="go on with the run in --out")
    evolve.add_argument("--minutes", type=float, metavar="M", help="stop after so long")
    evolve.add_argument(
        "--seeds", type=int, metavar="N", help="N runs with seeds from --seed on, in all cores"
    )
    evolve.add_argument(
        "--compare",
        action="store_true",
        help="with --seeds: against central selection and against no shaping, with statistics",
    )
    evolve.set_defaults(command=_evolve)


def _check(options: argparse.Namespace) -> int:
    from crcolony.config import load

    load(options.file)
    print(f"{options.file}: good")
    return _EXIT_OK


def _plot(options: argparse.Namespace) -> int:
    from crcolony.colony.plots import PlotsError, draw_plots

    try:
        for path in draw_plots(options.folder):
            print(path)
    except PlotsError as error:
        raise UsageError(str(error)) from None
    return _EXIT_OK


def _evolve(options: argparse.Namespace) -> int:
    if options.minutes is not None and options.minutes <= 0:
        raise UsageError(f"--minutes {options.minutes:g}: must be above 0")
    if options.resume:
        return _resume(options)
    from crcolony.config import load

    config = load(options.config, _settings(options))
    out = options.out or _new_folder()
    if options.seeds is not None:
        return _evolve_seeds(options, out)
    if options.compare:
        raise UsageError("--compare needs --seeds")
    from crcolony.colony.evolve import begin
    from crcolony.colony.terminal import run_in_terminal

    return run_in_terminal(*begin(out, config), minutes=options.minutes)


def _resume(options: argparse.Namespace) -> int:
    if options.out is None:
        raise UsageError("--resume needs --out, the folder to go on in")
    if options.seeds is not None or options.config is not None or _settings(options):
        raise UsageError(
            "--resume goes on with the folder's own config; other settings do not go with it"
        )
    from crcolony.colony.evolve import resume
    from crcolony.colony.terminal import run_in_terminal

    return run_in_terminal(*resume(options.out), minutes=options.minutes)


def _evolve_seeds(options: argparse.Namespace, out: Path) -> int:
    if options.seeds < 1:
        raise UsageError(f"--seeds {options.seeds}: must be at least 1")
    from crcolony.config import load
    from crcolony.experiments.survival import run_survival

    config = load(options.config, _settings(options))
    return run_survival(config, options.seeds, out, compare=options.compare)


def _settings(options: argparse.Namespace) -> list[str]:
    """Return the options that are settings as `key=value`, those of --set last."""
    named = [
        f"{name}={getattr(options, name)}"
        for name in ("robots", "generations", "seed", "selection")
        if getattr(options, name) is not None
    ]
    return named + list(options.settings)


def _new_folder() -> Path:
    """Name a folder that does not exist yet: runs/1, runs/2, …"""
    number = 1
    while Path(f"runs/{number}").exists():
        number += 1
    return Path(f"runs/{number}")
