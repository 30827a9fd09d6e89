"""Runs many colonies over seeds and conditions on all cores."""

import json
import os
from collections.abc import Callable, Iterable
from concurrent.futures import Executor, as_completed
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from crcolony.config import Config, ConfigError, load
from crcolony.in_process.run import resume_run, run_until_done, start_run
from crcolony.results.generation_table import read_table
from crcolony.shutdown import ShutdownSignal
from crcolony.storage.files import FolderError

LAST = 10
"""A run's end is the mean of so many last generations."""


@dataclass(frozen=True)
class Outcome:
    """One run in numbers: per agent, at generation 0 (`first`) and as the mean of the last generations (`end`)."""

    condition: str
    seed: int
    matings_first: float
    matings_end: float
    captures_first: float
    captures_end: float
    mating_lambda_end: float
    mating_tau_end: float
    foraging_tau_end: float
    history_hash: str


def run_once(condition: str, config: Config, folder: Path) -> Outcome | None:
    """Run one colony to its end into a folder, or go on with it there; it can run in any process.

    Stops after Ctrl-C, or when the process that started it is gone, and returns None then; what it did is kept.
    """
    stop, parent = ShutdownSignal(None), os.getppid()
    if (folder / "config.toml").exists():
        if load(folder / "config.toml") != config:
            raise ConfigError(f"{folder / 'config.toml'}: another config than this comparison has")
        results, colony = resume_run(folder)
    else:
        results, colony = start_run(folder, config)
    try:
        is_over = run_until_done(
            results, colony, lambda: stop() or os.getppid() != parent, lambda _: None
        )
    finally:
        results.close()
    return read_outcome(condition, folder) if is_over else None


def read_outcome(condition: str, folder: Path) -> Outcome:
    """Read a finished run's numbers from its folder; raises FolderError if that is not possible."""
    try:
        run = json.loads((folder / "run.json").read_text("utf-8"))
        rows = read_table(folder / "generations.csv")

        def end(name: str) -> float:
            return float(np.mean([float(row[name]) for row in rows[-LAST:]]))

        return Outcome(
            condition=condition,
            seed=run["seed"],
            matings_first=float(rows[0]["matings"]),
            matings_end=end("matings"),
            captures_first=float(rows[0]["captures"]),
            captures_end=end("captures"),
            mating_lambda_end=end("mating.lambda mean"),
            mating_tau_end=end("mating.tau q50"),
            foraging_tau_end=end("foraging.tau q50"),
            history_hash=run["history_hash"],
        )
    except (OSError, IndexError, KeyError, TypeError, ValueError) as error:
        raise FolderError(f"{folder}: not the results of a whole run: {error}") from None


def _run_all(
    executor: Executor,
    jobs: list[tuple[str, Config]],
    out: Path,
    is_stopped: Callable[[], bool],
) -> Iterable[Outcome]:
    """Yield the outcomes as they come; after a stop or an error start no more."""
    running = [
        executor.submit(
            run_once, name, config, out / name.replace(" ", "-") / f"seed-{config.seed}"
        )
        for name, config in jobs
    ]
    try:
        for future in as_completed(running):
            outcome = future.result()
            if outcome is None or is_stopped():
                break
            yield outcome
    finally:
        executor.shutdown(cancel_futures=True)
