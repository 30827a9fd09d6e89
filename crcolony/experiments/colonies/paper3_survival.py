"""Darwinian embodied evolution of the learning ability for survival (Paper III, thesis 5.3).

Runs a colony over many seeds; to compare, also with central selection, with the shaping genes switched off, and with
conceptions that do not depend on energy. The thesis reports that evolution performs as well as with central selection,
that tau evolves to 0, and that runs with more matings have a smaller lambda of the mating module. The results of these
runs are printed whether they agree or not.
"""

import importlib.util
from collections.abc import Mapping, Sequence
from pathlib import Path

import msgspec

from crcolony.config import Config
from crcolony.errors import EXIT_OK
from crcolony.experiments.colonies.neutral_drift import Drift, measure_drift
from crcolony.experiments.colonies.outcomes import Outcome
from crcolony.experiments.colonies.sweep import run_all, run_folder
from crcolony.experiments.pools.usable_cpus import usable_cpus
from crcolony.experiments.pools.worker_processes import worker_processes
from crcolony.shutdown import ShutdownSignal
from crcolony.storage.claimed_folder import claim_folder
from crcolony.storage.files import FolderError


def conditions_of(config: Config, compare: bool) -> dict[str, Config]:
    """Return the configs to run by the names of their conditions."""
    if not compare:
        return {config.selection: config}
    replace = msgspec.structs.replace
    implicit = replace(config, selection="implicit")
    conditions = {
        "implicit": implicit,
        "central": replace(implicit, selection="central"),
        "without shaping": replace(implicit, learning=replace(config.learning, shaping=False)),
        "without health": replace(implicit, life=replace(config.life, conception_exponent=0.0)),
    }
    return {
        name: condition
        for name, condition in conditions.items()
        if name == "implicit" or condition != implicit
    }


def run_survival(
    conditions: Mapping[str, Config], seeds: int, out: Path | None, resume: bool
) -> int:
    """Run all conditions on all usable CPUs, write and print a report, and return the exit code.

    Each has so many seeds, from that of its config on.
    With `resume`, finished runs in `out` are only read and others are resumed; without it `out` must be empty (None:
    the next free runs/N). Raises FolderError, ConfigError, and ImportError if scipy is missing.
    """
    if importlib.util.find_spec("scipy") is None:
        raise ImportError("statistics need scipy: pip install 'crcolony[experiments]'")
    with claim_folder(out, "evolve --seeds") as claimed:
        if claimed.is_new:
            claimed.begin()
        elif not resume:
            raise FolderError(f"{out}: not empty; choose another --out or use --resume")
        return _run_all_seeds(conditions, seeds, claimed.path)


def _run_all_seeds(conditions: Mapping[str, Config], seeds: int, out: Path) -> int:
    jobs = [
        (name, msgspec.structs.replace(condition, seed=condition.seed + k))
        for k in range(seeds)
        for name, condition in conditions.items()
    ]
    outcomes: list[Outcome] = []
    stop = ShutdownSignal()
    workers = min(usable_cpus(), len(jobs))
    with worker_processes(workers, stop) as executor:
        for outcome in run_all(executor, workers, jobs, out, stop):
            outcomes.append(outcome)
            print(
                f"{len(outcomes)} of {len(jobs)}: {outcome.condition}, seed {outcome.seed}:"
                f" matings {outcome.matings_first:.2f} to {outcome.matings_end:.2f},"
                f" history hash: {outcome.history_hash}",
                flush=True,
            )
    if len(outcomes) == len(jobs):
        order = list(conditions)
        outcomes.sort(key=lambda outcome: (order.index(outcome.condition), outcome.seed))
        with stop.interruptible():
            _report(outcomes, out)
            return EXIT_OK
    print(f"stopped; resume with the same command and --resume --out {out}")
    return EXIT_OK


def _report(outcomes: Sequence[Outcome], out: Path) -> None:
    """Write and print the report of all runs of a comparison; neutral genes take about a second a run."""
    from crcolony.experiments.colonies.comparison_report import write_comparison  # imports scipy

    folders: dict[str, list[Path]] = {}
    for outcome in outcomes:
        folder = run_folder(out, outcome.condition, outcome.seed)
        folders.setdefault(outcome.condition, []).append(folder)
    print()
    drifts: list[Drift] = []
    try:
        for condition, own in folders.items():
            drifts += measure_drift(condition, own)
    except FolderError as error:
        print(f"no neutral genes: {error}")
    for line in write_comparison(outcomes, drifts, out):
        print(line)
