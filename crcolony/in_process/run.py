"""Runs an embedded colony into a results folder: generation by generation, until done or told to stop."""

import os
import time
from collections.abc import Callable
from pathlib import Path

from crcolony.config import Config, ConfigError
from crcolony.in_process.colony import EmbeddedColony
from crcolony.results.run_folder import Results
from crcolony.robot.batch import weight_bytes
from crcolony.storage.files import ResultsError

_BREATH_ROBOT_STEPS = 30_000
"""Robot-steps between two looks at the clock and at a request to stop: some hundredths of a second."""
_CHECKPOINT_S = 10.0
_CHECKPOINT_SHARE = 0.05
"""Writing checkpoints takes at most this share of the time."""

Progress = Callable[[EmbeddedColony], None]


def evolve(
    results: Results,
    colony: EmbeddedColony,
    is_stopped: Callable[[], bool],
    progress: Progress,
) -> bool:
    """Run the colony until its last generation or until `is_stopped`; return whether it is done.

    Everything is written when it returns. `progress` is called often. Raises ResultsError as `Results` does.
    """
    breath_ticks = max(1, _BREATH_ROBOT_STEPS // len(colony.robots))
    due_s = time.monotonic() + _CHECKPOINT_S
    while not is_done(colony) and not is_stopped():
        before = colony.generation
        colony.run(breath_ticks)
        if colony.generation > before:
            results.write_generation(colony.summary)
        progress(colony)
        start_s = time.monotonic()
        if start_s > due_s:
            results.write_checkpoint(colony.save(), colony.generation, "running")
            now_s = time.monotonic()
            due_s = now_s + max(_CHECKPOINT_S, (now_s - start_s) / _CHECKPOINT_SHARE)
    status = "done" if is_done(colony) else "stopped"
    results.write_checkpoint(colony.save(), colony.generation, status)
    return is_done(colony)


def is_done(colony: EmbeddedColony) -> bool:
    """Tell whether the colony has come to the last generation of its config (0: there is none)."""
    return 0 < colony.config.generations <= colony.generation


def begin(folder: Path, config: Config) -> tuple[Results, EmbeddedColony]:
    """Start a new run in a new folder; raises ConfigError or ResultsError and leaves nothing behind."""
    results = Results(folder, config)
    colony = _new_colony(results)
    colony.begin()
    results.create(colony.save())
    return results, colony


def resume(folder: Path) -> tuple[Results, EmbeddedColony]:
    """Go on with a run where its checkpoint stands; raises ResultsError if it does not fit its config."""
    results, saved = Results.resume(folder)
    colony = _new_colony(results)
    try:
        colony.restore(saved)
    except (IndexError, KeyError, TypeError, ValueError) as error:
        results.close()
        raise ResultsError(f"{folder / 'checkpoint.npz'}: does not fit: {error}") from None
    return results, colony


def _new_colony(results: Results) -> EmbeddedColony:
    config = results.config
    needed = 2 * weight_bytes(config.robots, config.learning, config.life)  # a checkpoint copies
    present = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    if needed > present:
        raise ConfigError(
            f"robots: {config.robots} robots of {config.life.agents} agents need"
            f" {needed / 1e9:.0f} GB of memory, this machine has {present / 1e9:.0f}"
        )
    try:
        return EmbeddedColony(config, results.record)
    except ValueError as error:
        raise ConfigError(str(error)) from None
