"""Runs many colonies, over seeds and conditions, on any `concurrent.futures.Executor`."""

import json
import os
from collections.abc import Callable, Iterable
from concurrent.futures import Executor, as_completed
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from crcolony.config import Config, ConfigError, load
from crcolony.in_process.run import resume_run, run_until_done, start_run
from crcolony.results.generation_table import GENERATION_TABLE, read_table
from crcolony.shutdown import ShutdownSignal
from crcolony.storage.files import FolderError

LAST_GENERATIONS = 10
"""The end of a run is the mean over so many last generations."""


@dataclass(frozen=True)
class Outcome:
    """The result of one run, per agent: at generation 0 (`first`), and the mean of the last generations (`end`)."""

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
    """Run one colony to its end in a folder, or resume it there; this can run in any process.

    After Ctrl-C, or when the parent process is gone, it stops and returns None; the run can be resumed.
    """
    stop, parent = ShutdownSignal(None), os.getppid()
    if (folder / "config.toml").exists():
        if load(folder / "config.toml") != config:
            raise ConfigError(f"{folder / 'config.toml'}: not the config of this comparison")
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
    """Read the outcome of a finished run from its folder; raises FolderError if that is impossible."""
    try:
        run = json.loads((folder / "run.json").read_text("utf-8"))
        rows = read_table(folder / GENERATION_TABLE)

        def end(name: str) -> float:
            return float(np.mean([float(row[name]) for row in rows[-LAST_GENERATIONS:]]))

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
        raise FolderError(f"{folder}: not the results of a finished run: {error}") from None


def run_all(
    executor: Executor,
    jobs: list[tuple[str, Config]],
    out: Path,
    is_stopped: Callable[[], bool],
) -> Iterable[Outcome]:
    """Run jobs of a condition and a config each, and yield outcomes as runs finish; after a stop start no more."""
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
