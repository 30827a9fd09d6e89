"""Darwinian embodied evolution of the learning ability for survival (Paper III, thesis 5.3).

Runs a colony over many seeds; to compare, also with central selection and with the shaping genes switched off. The
thesis reports that evolution performs as well as with central selection, that tau evolves to 0, and that runs with more
matings have a smaller lambda of the mating module. The results of these runs are printed whether they agree or not.
"""

import csv
import importlib.util
import os
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from pathlib import Path

import msgspec

from crcolony.config import Config
from crcolony.errors import EXIT_OK
from crcolony.experiments.statistics import format_report
from crcolony.experiments.sweep import Outcome, run_all
from crcolony.shutdown import ShutdownSignal
from crcolony.storage.files import FolderError


def conditions_of(config: Config, compare: bool) -> dict[str, Config]:
    """Return the configs to run by the names of their conditions."""
    conditions: dict[str, Config] = {config.selection: config}
    if compare:
        replace = msgspec.structs.replace
        conditions["central"] = replace(config, selection="central")
        unshaped = replace(config.learning, shaping=False)
        conditions["without shaping"] = replace(config, learning=unshaped)
    return conditions


def run_survival(config: Config, seeds: int, out: Path, compare: bool, resume: bool) -> int:
    """Run all seeds of all conditions on all cores, write `outcomes.csv`, print a report, and return the exit code.

    With `resume`, finished runs in `out` are only read and others are resumed; without it `out` must be empty.
    Raises FolderError, ConfigError, and ImportError if scipy is missing.
    """
    if importlib.util.find_spec("scipy") is None:
        raise ImportError("statistics need scipy: pip install 'crcolony[experiments]'")
    if not resume and out.exists() and any(out.iterdir()):
        raise FolderError(f"{out}: not empty; choose another --out or use --resume")
    jobs = [
        (name, msgspec.structs.replace(condition, seed=config.seed + k))
        for k in range(seeds)
        for name, condition in conditions_of(config, compare).items()
    ]
    outcomes: list[Outcome] = []
    stop = ShutdownSignal(None)
    with ProcessPoolExecutor(os.cpu_count()) as executor:
        for outcome in run_all(executor, jobs, out, stop):
            outcomes.append(outcome)
            print(
                f"{len(outcomes)} of {len(jobs)}: {outcome.condition}, seed {outcome.seed}:"
                f" matings {outcome.matings_first:.2f} to {outcome.matings_end:.2f},"
                f" history hash: {outcome.history_hash}",
                flush=True,
            )
    if len(outcomes) < len(jobs):
        print(f"stopped; resume with the same command and --resume --out {out}")
        return EXIT_OK
    outcomes.sort(key=lambda outcome: (outcome.condition, outcome.seed))
    _write(outcomes, out / "outcomes.csv")
    for line in format_report(outcomes):
        print(line)
    return EXIT_OK


def _write(outcomes: list[Outcome], path: Path) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=list(asdict(outcomes[0])))
        writer.writeheader()
        writer.writerows(asdict(outcome) for outcome in outcomes)
