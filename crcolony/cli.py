"""The command line. Heavy imports wait until a command needs them, so that `--help` answers at once."""

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

_MOST_MINUTES = 366 * 24 * 60
_EXIT_OK, _EXIT_WRONG_INPUT, _EXIT_INTERRUPTED, _EXIT_UNREAD = 0, 2, 130, 141


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; return its exit code: 0 done, 2 wrong input (said in one line), 130 interrupted, 141 unread."""
    options = _parser().parse_args(arguments)
    from crcolony.colony.results import ResultsError
    from crcolony.config import ConfigError

    try:
        code: int = options.command(options)
    except (ConfigError, ImportError, ResultsError, UsageError) as error:
        print(f"crcolony: {error}", file=sys.stderr)
        return _EXIT_WRONG_INPUT
    except KeyboardInterrupt:
        print("crcolony: interrupted", file=sys.stderr)
        return _EXIT_INTERRUPTED
    except BrokenPipeError:  # whoever read our output is gone, as in `crcolony evolve | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return _EXIT_UNREAD
    return code


class UsageError(Exception):
    """Options that do not go together."""


class _Parser(argparse.ArgumentParser):
    """Says what is wrong with the options in one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(_EXIT_WRONG_INPUT, f"{self.prog}: {message} (see {self.prog} --help)\n")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
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
    evolve.add_argument("--generations", type=int, metavar="N", help="0: until stopped")
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
    from crcolony.config import load

    if options.minutes is not None and not 0.0 < options.minutes < _MOST_MINUTES:
        raise UsageError(f"--minutes {options.minutes:g}: must be above 0 and at most a year")
    if options.seeds is not None:
        return _evolve_seeds(options)
    if options.compare:
        raise UsageError("--compare needs --seeds")
    if options.resume:
        return _resume(options)
    from crcolony.colony.evolve import begin
    from crcolony.colony.terminal import run_in_terminal

    config = load(options.config, _settings(options))
    _say_if_compiling()
    return run_in_terminal(*begin(options.out or _new_folder(), config), minutes=options.minutes)


def _say_if_compiling() -> None:
    from crcolony.compiled import is_first_start

    if is_first_start():
        print("the first start compiles the colony, which takes half a minute", flush=True)


def _resume(options: argparse.Namespace) -> int:
    if options.out is None:
        raise UsageError("--resume needs --out, the folder to go on in")
    if options.config is not None or _settings(options):
        raise UsageError(
            "--resume goes on with the folder's own config; other settings do not go with it"
        )
    from crcolony.colony.evolve import resume
    from crcolony.colony.terminal import run_in_terminal

    _say_if_compiling()
    return run_in_terminal(*resume(options.out), minutes=options.minutes)


def _evolve_seeds(options: argparse.Namespace) -> int:
    from crcolony.config import load
    from crcolony.experiments.survival import run_survival

    if options.seeds < 1:
        raise UsageError(f"--seeds {options.seeds}: must be at least 1")
    if options.minutes is not None:
        raise UsageError("--minutes does not go with --seeds")
    if options.resume and options.out is None:
        raise UsageError("--resume needs --out, the folder to go on in")
    config = load(options.config, _settings(options))
    if config.generations == 0:
        raise UsageError("--generations 0 does not go with --seeds: such a run has no end")
    out = options.out or _new_folder()
    _say_if_compiling()
    return run_survival(config, options.seeds, out, options.compare, options.resume)


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
