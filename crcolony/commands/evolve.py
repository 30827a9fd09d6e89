"""`crcolony evolve`: evolve an in-process colony on this machine, as fast as possible."""

import argparse
from pathlib import Path

from crcolony.commands.earlier_run import Start, add_from
from crcolony.commands.options import (
    UsageError,
    add_config,
    add_examples,
    add_no_plots,
    check_minutes,
    load_config,
    print_if_compiling,
    settings_of,
)


def add_evolve(evolve: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony evolve`."""
    add_config(evolve)
    add_from(evolve)
    evolve.add_argument(
        "-n", "--robots", type=int, metavar="N", help="robots in the arena (default 4)"
    )
    evolve.add_argument(
        "--selection",
        choices=("implicit", "central", "pgta", "pega", "medea", "ompac", "gpbt_pl"),
        help="default: implicit; the others are to compare with, central above all (docs/schemes.md)",
    )
    evolve.add_argument(
        "--out", type=Path, metavar="DIR", help="results folder; default: the next free runs/N"
    )
    evolve.add_argument(
        "--resume",
        action="store_true",
        help="resume the run in --out; with --generations N a finished one goes on to its Nth",
    )
    evolve.add_argument("--minutes", type=float, metavar="M", help="stop after so many minutes")
    add_no_plots(evolve)
    _add_many_runs(evolve)
    evolve.set_defaults(command=_evolve)
    add_examples(
        evolve,
        (
            "crcolony evolve -n 8 --generations 100 --seed 3",
            "a hundred generations of eight robots",
        ),
        (
            "crcolony evolve --set life.agents=10 --out runs/small",
            "another setting; all are printed by: crcolony config",
        ),
        (
            "crcolony evolve --resume --out runs/small --generations 500",
            "go on with that run to generation 500",
        ),
        (
            "crcolony evolve --seeds 20 --compare --out runs/thesis",
            "the thesis' comparison, with statistics",
        ),
        (
            "crcolony evolve --seeds 5 --sweep life.energy_per_step=0.001,0.002 --out runs/sweep",
            "a setting's values side by side",
        ),
    )


def _add_many_runs(evolve: argparse.ArgumentParser) -> None:
    """Add the options of many runs: over seeds, conditions and settings."""
    evolve.add_argument(
        "--seeds", type=int, metavar="N", help="N runs on all cores, with seeds from --seed on"
    )
    evolve.add_argument(
        "--compare",
        action="store_true",
        help="with --seeds: also run central selection, no shaping, and conception that ignores energy, and compare",
    )
    evolve.add_argument(
        "--sweep",
        action="append",
        default=[],
        metavar="KEY=VALUE,VALUE",
        dest="sweeps",
        help="with --seeds: a condition for each value; repeated, for each combination of values",
    )


def _evolve(options: argparse.Namespace) -> int:

    check_minutes(options.minutes)
    if options.seeds is not None:
        return _evolve_seeds(options)
    for option, is_given in (("--compare", options.compare), ("--sweep", options.sweeps)):
        if is_given:
            raise UsageError(f"{option} needs --seeds")
    if options.resume:
        return _resume(options)
    from crcolony.in_process.progress_display import run_in_terminal
    from crcolony.in_process.run import start_run

    start = Start(options, "evolve")
    if options.robots is None and start.earlier is not None:
        options.robots = len(start.earlier.subpopulations)
    config = load_config(start.config_file(options), settings_of(options))
    beginning = start.beginning(config, config.robots)
    results, colony = start_run(options.out, config, beginning)
    return run_in_terminal(results, colony, options.minutes, options.has_plots)


def _resume(options: argparse.Namespace) -> int:
    if options.out is None:
        raise UsageError("--resume needs --out, the folder of the run")
    if options.from_run is not None:
        raise UsageError("--resume goes on with the robots in --out: it cannot be used with --from")
    generations, options.generations = options.generations, None
    if options.config is not None or settings_of(options):
        raise UsageError(
            "--resume uses the config of the folder: of all settings it can be used with --generations only"
        )
    from crcolony.in_process.progress_display import run_in_terminal
    from crcolony.in_process.run import resume_run

    results, colony = resume_run(options.out, generations)
    return run_in_terminal(results, colony, options.minutes, options.has_plots)


def _evolve_seeds(options: argparse.Namespace) -> int:
    from crcolony.experiments.colonies.paper3_survival import conditions_of, run_survival
    from crcolony.experiments.framework.setting_sweep import sweep_conditions

    if options.seeds < 1:
        raise UsageError(f"--seeds {options.seeds}: must be at least 1")
    if options.minutes is not None:
        raise UsageError("--minutes cannot be used with --seeds")
    if options.from_run is not None:
        raise UsageError(
            "--from cannot be used with --seeds: such runs begin with random genotypes"
        )
    if options.resume and options.out is None:
        raise UsageError("--resume needs --out, the folder of the run")
    if options.compare and options.sweeps:
        raise UsageError("--compare cannot be used with --sweep: each has its own conditions")
    config = load_config(options.config, settings_of(options))
    conditions = conditions_of(config, options.compare)
    if options.sweeps:
        conditions = sweep_conditions(options.config, settings_of(options), options.sweeps)
    if any(condition.generations == 0 for condition in conditions.values()):
        raise UsageError("--generations 0 cannot be used with --seeds: such a run has no end")
    print_if_compiling()
    return run_survival(conditions, options.seeds, options.out, options.resume)
