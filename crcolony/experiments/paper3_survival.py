"""Darwinian embodied evolution of the learning ability for survival (Paper III, thesis 5.3).

Runs a colony over many seeds; to compare, also with central selection and with the shaping genes switched off. The
thesis says: similar evolutionary performance as central selection; tau evolves to 0; over the runs, more matings go
with a smaller lambda of the mating module. What these runs say is printed as it is.
"""

import csv
import importlib.util
import os
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from pathlib import Path

import msgspec

from crcolony.config import Config
from crcolony.experiments.statistics import report
from crcolony.experiments.sweep import Outcome, _run_all
from crcolony.shutdown import ShutdownSignal
from crcolony.storage.files import FolderError


def arms_of(config: Config, compare: bool) -> dict[str, Config]:
    """Return the configs to run, by name."""
    conditions: dict[str, Config] = {config.selection: config}
    if compare:
        replace = msgspec.structs.replace
        conditions["central"] = replace(config, selection="central")
        unshaped = replace(config.learning, shaping=False)
        conditions["without shaping"] = replace(config, learning=unshaped)
    return conditions


def run_survival(config: Config, seeds: int, out: Path, compare: bool, goes_on: bool) -> int:
    """Run all seeds of all arms in all cores, write `outcomes.csv`, and print what they say; return the exit code.

    `goes_on`: runs in `out` that are done are only read, and others go on; without it `out` must be empty.
    """
    if importlib.util.find_spec("scipy") is None:
        raise ImportError("statistics need scipy: pip install 'crcolony[experiments]'")
    if not goes_on and out.exists() and any(out.iterdir()):
        raise FolderError(f"{out}: not empty; choose another --out or use --resume")
    jobs = [
        (name, msgspec.structs.replace(condition, seed=config.seed + k))
        for k in range(seeds)
        for name, condition in arms_of(config, compare).items()
    ]
    outcomes: list[Outcome] = []
    stop = ShutdownSignal(None)
    with ProcessPoolExecutor(os.cpu_count()) as executor:
        for outcome in _run_all(executor, jobs, out, stop):
            outcomes.append(outcome)
            print(
                f"{len(outcomes)} of {len(jobs)}: {outcome.condition}, seed {outcome.seed}:"
                f" matings {outcome.matings_first:.2f} to {outcome.matings_end:.2f},"
                f" history hash: {outcome.history_hash}",
                flush=True,
            )
    if len(outcomes) < len(jobs):
        print(f"stopped; go on with the same command and --resume --out {out}")
        return 0
    outcomes.sort(key=lambda outcome: (outcome.condition, outcome.seed))
    _write(outcomes, out / "outcomes.csv")
    for line in report(outcomes):
        print(line)
    return 0


def _write(outcomes: list[Outcome], path: Path) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=list(asdict(outcomes[0])))
        writer.writeheader()
        writer.writerows(asdict(outcome) for outcome in outcomes)
