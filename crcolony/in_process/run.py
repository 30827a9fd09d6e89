"""Runs an embedded colony into a results folder: generation by generation, until done or told to stop."""

import os
import time
from collections.abc import Callable
from pathlib import Path

from crcolony.config import Config, ConfigError
from crcolony.in_process.colony import InProcessColony
from crcolony.results.run_folder import RunFolder
from crcolony.robot.batch import weight_bytes
from crcolony.storage.files import FolderError

_BREATH_ROBOT_STEPS = 30_000
"""Robot-steps between two looks at the clock and at a request to stop: some hundredths of a second."""
_CHECKPOINT_S = 10.0
_CHECKPOINT_SHARE = 0.05
"""Writing checkpoints takes at most this share of the time."""

Progress = Callable[[InProcessColony], None]


def run_until_done(
    results: RunFolder,
    colony: InProcessColony,
    is_stopped: Callable[[], bool],
    progress: Progress,
) -> bool:
    """Run the colony until its last generation or until `is_stopped`; return whether it is done.

    Everything is written when it returns. `progress` is called often. Raises FolderError as `RunFolder` does.
    """
    breath_ticks = max(1, _BREATH_ROBOT_STEPS // len(colony.robots))
    due_s = time.monotonic() + _CHECKPOINT_S
    while not is_finished(colony) and not is_stopped():
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
    status = "done" if is_finished(colony) else "stopped"
    results.write_checkpoint(colony.save(), colony.generation, status)
    return is_finished(colony)


def is_finished(colony: InProcessColony) -> bool:
    """Tell whether the colony has come to the last generation of its config (0: there is none)."""
    return 0 < colony.config.generations <= colony.generation


def start_run(folder: Path, config: Config) -> tuple[RunFolder, InProcessColony]:
    """Start a new run in a new folder; raises ConfigError or FolderError and leaves nothing behind."""
    results = RunFolder(folder, config)
    colony = _new_colony(results)
    colony.start()
    results.create(colony.save())
    return results, colony


def resume_run(folder: Path) -> tuple[RunFolder, InProcessColony]:
    """Go on with a run where its checkpoint stands; raises FolderError if it does not fit its config."""
    results, saved = RunFolder.resume(folder)
    colony = _new_colony(results)
    try:
        colony.restore(saved)
    except (IndexError, KeyError, TypeError, ValueError) as error:
        results.close()
        raise FolderError(f"{folder / 'checkpoint.npz'}: does not fit: {error}") from None
    return results, colony


def _new_colony(results: RunFolder) -> InProcessColony:
    config = results.config
    needed = 2 * weight_bytes(config.robots, config.learning, config.life)  # a checkpoint copies
    present = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    if needed > present:
        raise ConfigError(
            f"robots: {config.robots} robots of {config.life.agents} agents need"
            f" {needed / 1e9:.0f} GB of memory, this machine has {present / 1e9:.0f}"
        )
    try:
        return InProcessColony(config, results.add_event)
    except ValueError as error:
        raise ConfigError(str(error)) from None
