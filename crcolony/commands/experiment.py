"""`crcolony experiment`: reproduce a result of the thesis, and see each claim beside what was measured."""

import argparse
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from crcolony.commands.options import UsageError, add_examples, print_if_compiling
from crcolony.errors import EXIT_OK

if TYPE_CHECKING:
    from crcolony.experiments.pools.worker_pool import OpenPool

_MOST_SEEDS = 100_000
_HIGHEST_SEED = 2**62


def add_experiment(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony experiment`."""
    name = parser.add_argument(
        "name", nargs="?", metavar="NAME", help="the experiment; without it all are listed"
    )
    name.completer = _complete_name  # type: ignore[attr-defined]
    parser.add_argument("--list", action="store_true", help="list all experiments")
    parser.add_argument(
        "--seeds", type=int, metavar="N", help="runs of each condition; default: as the claims ask"
    )
    parser.add_argument("--seed", type=int, metavar="N", help="the first seed; default: 1")
    parser.add_argument(
        "--quick",
        action="store_true",
        help="small runs, which show that the experiment runs: they are never claims",
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="results folder; default: the next free runs/N"
    )
    parser.add_argument("--resume", action="store_true", help="go on with the experiment in --out")
    parser.add_argument("--workers", type=int, metavar="N", help="runs at once; default: one a CPU")
    parser.add_argument(
        "--executor",
        choices=("processes", "dask", "mpi"),
        default="processes",
        help="where runs are made: processes of this machine (default), a Dask cluster, or an MPI run",
    )
    parser.add_argument(
        "--scheduler", metavar="ADDRESS", help="of the Dask cluster, as tcp://host:8786"
    )
    parser.set_defaults(command=_experiment)
    add_examples(
        parser,
        ("crcolony experiment", "which experiments there are"),
        (
            "crcolony experiment learning-ability --out runs/ability",
            "all its runs, its claims, its figure",
        ),
        (
            "crcolony experiment learning-ability --resume --out runs/ability",
            "go on where it was stopped",
        ),
        (
            "crcolony experiment learning-ability --executor dask --scheduler tcp://host:8786",
            "on a cluster",
        ),
    )


def _complete_name(**_: object) -> list[str]:
    """Return the names of experiments (called by argcomplete)."""
    from crcolony.experiments.framework.registration import registered_names

    return registered_names()


def _experiment(options: argparse.Namespace) -> int:
    if options.list or options.name is None:
        return _list(options)
    from crcolony.experiments.framework.catalogue import find_experiment
    from crcolony.experiments.framework.registration import registration_text
    from crcolony.experiments.framework.run_experiment import Request, run_experiment

    experiment = find_experiment(options.name)
    _check_numbers(options)
    if options.resume and options.out is None:
        raise UsageError("--resume needs --out, the folder of the experiment")
    open_pool = _pool(options)
    request = Request(options.seeds, options.seed, options.quick, options.out, options.resume)
    print_if_compiling()
    return run_experiment(
        experiment,
        registration_text(options.name),
        request,
        open_pool,
    )


def _pool(options: argparse.Namespace) -> "OpenPool":
    """Return what provides the workers that are asked for."""
    if options.executor == "dask":
        if options.scheduler is None:
            raise UsageError("--executor dask needs --scheduler, as in --scheduler tcp://host:8786")
        from crcolony.experiments.pools.dask_pool import dask_cluster

        return partial(dask_cluster, options.scheduler, options.workers)
    if options.scheduler is not None:
        raise UsageError("--scheduler is for --executor dask")
    if options.executor == "mpi":
        from crcolony.experiments.pools.mpi_pool import mpi_processes

        return partial(mpi_processes, options.workers)
    from crcolony.experiments.pools.process_pool import processes

    return partial(processes, options.workers)


def _check_numbers(options: argparse.Namespace) -> None:
    if options.workers is not None and options.workers < 1:
        raise UsageError(f"--workers {options.workers}: must be at least 1")
    if options.seeds is not None and not 1 <= options.seeds <= _MOST_SEEDS:
        raise UsageError(f"--seeds {options.seeds}: must be from 1 to {_MOST_SEEDS}")
    if options.seed is not None and not 0 <= options.seed <= _HIGHEST_SEED:
        raise UsageError(f"--seed {options.seed}: must be from 0 to {_HIGHEST_SEED}")


def _list(options: argparse.Namespace) -> int:
    if options.name is not None:
        raise UsageError("--list is without a NAME")
    from crcolony.experiments.framework.catalogue import summaries
    from crcolony.terminal import plain_console

    console = plain_console()
    for name, registration in summaries().items():
        console.print(
            f"{name}: {registration.summary} ({registration.source}; {len(registration.claims)} claims,"
            f" {registration.seeds} seeds)",
            soft_wrap=True,
        )
    return EXIT_OK
