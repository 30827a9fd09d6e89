"""`crcolony evolve`: evolve an in-process colony on this machine, as fast as possible."""

import argparse
from pathlib import Path

from crcolony.commands.options import (
    UsageError,
    add_config,
    check_minutes,
    new_folder,
    print_if_compiling,
    settings_of,
)


def add_evolve(evolve: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony evolve`."""
    add_config(evolve)
    evolve.add_argument("--robots", type=int, metavar="N", help="robots in the arena (default 4)")
    evolve.add_argument(
        "--selection",
        choices=("implicit", "central"),
        help="default: implicit; central is the baseline to compare with",
    )
    evolve.add_argument(
        "--out", type=Path, metavar="DIR", help="results folder; default: the next free runs/N"
    )
    evolve.add_argument("--resume", action="store_true", help="resume the run in --out")
    evolve.add_argument("--minutes", type=float, metavar="M", help="stop after so many minutes")
    evolve.add_argument(
        "--seeds", type=int, metavar="N", help="N runs on all cores, with seeds from --seed on"
    )
    evolve.add_argument(
        "--compare",
        action="store_true",
        help="with --seeds: also run central selection and no shaping, and compare them",
    )
    evolve.set_defaults(command=_evolve)


def _evolve(options: argparse.Namespace) -> int:
    from crcolony.config import load

    check_minutes(options.minutes)
    if options.seeds is not None:
        return _evolve_seeds(options)
    if options.compare:
        raise UsageError("--compare needs --seeds")
    if options.resume:
        return _resume(options)
    from crcolony.in_process.progress_display import run_in_terminal
    from crcolony.in_process.run import start_run

    config = load(options.config, settings_of(options))
    print_if_compiling()
    return run_in_terminal(*start_run(options.out or new_folder(), config), minutes=options.minutes)


def _resume(options: argparse.Namespace) -> int:
    if options.out is None:
        raise UsageError("--resume needs --out, the folder of the run")
    if options.config is not None or settings_of(options):
        raise UsageError(
            "--resume uses the config of the folder: it cannot be used with other settings"
        )
    from crcolony.in_process.progress_display import run_in_terminal
    from crcolony.in_process.run import resume_run

    print_if_compiling()
    return run_in_terminal(*resume_run(options.out), minutes=options.minutes)


def _evolve_seeds(options: argparse.Namespace) -> int:
    from crcolony.config import load
    from crcolony.experiments.paper3_survival import run_survival

    if options.seeds < 1:
        raise UsageError(f"--seeds {options.seeds}: must be at least 1")
    if options.minutes is not None:
        raise UsageError("--minutes cannot be used with --seeds")
    if options.resume and options.out is None:
        raise UsageError("--resume needs --out, the folder of the run")
    config = load(options.config, settings_of(options))
    if config.generations == 0:
        raise UsageError("--generations 0 cannot be used with --seeds: such a run has no end")
    out = options.out or new_folder()
    print_if_compiling()
    return run_survival(config, options.seeds, out, options.compare, options.resume)
