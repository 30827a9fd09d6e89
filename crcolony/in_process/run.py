"""Runs an in-process colony and writes its results folder, until it is finished or stopped."""

import os
import time
from collections.abc import Callable
from pathlib import Path

from crcolony.config import Config, ConfigError, load
from crcolony.evolution.founders import Founders
from crcolony.in_process.colony import InProcessColony
from crcolony.results.run_folder import CHECKPOINT_FILE, RunFolder
from crcolony.robot.batch import weight_bytes
from crcolony.storage.checkpoint import CheckpointError, read_checkpoint
from crcolony.storage.files import FolderError
from crcolony.storage.founders_file import Beginning

_CHUNK_ROBOT_STEPS = 30_000
"""Robot-steps between two checks of the clock and of a request to stop: some hundredths of a second."""
_CHECKPOINT_S = 10.0
"""Time between two checkpoints, at least."""
_CHECKPOINT_SHARE = 0.05
"""Checkpoints take at most this share of the time."""

Progress = Callable[[InProcessColony], None]


def run_until_done(
    results: RunFolder,
    colony: InProcessColony,
    is_stopped: Callable[[], bool],
    on_progress: Progress,
) -> bool:
    """Run the colony until its last generation or until `is_stopped()`; return whether it is finished.

    Everything is written when this returns. `on_progress` is called several times a second. Raises FolderError.
    """
    chunk_ticks = max(1, _CHUNK_ROBOT_STEPS // len(colony.robots))
    due_s = time.monotonic() + _CHECKPOINT_S
    while not is_finished(colony) and not is_stopped():
        before = colony.generation
        colony.run(chunk_ticks)
        if colony.generation > before:
            results.write_generation(colony.summary)
        on_progress(colony)
        start_s = time.monotonic()
        if start_s > due_s:
            results.write_checkpoint(colony.save(), colony.generation, "running")
            now_s = time.monotonic()
            due_s = now_s + max(_CHECKPOINT_S, (now_s - start_s) / _CHECKPOINT_SHARE)
    status = "done" if is_finished(colony) else "stopped"
    results.write_checkpoint(colony.save(), colony.generation, status)
    return is_finished(colony)


def is_finished(colony: InProcessColony) -> bool:
    """Return whether the colony has ended the last generation of its config (0: there is no last one)."""
    return 0 < colony.config.generations <= colony.generation


def start_run(
    folder: Path | None, config: Config, beginning: Beginning | None = None
) -> tuple[RunFolder, InProcessColony]:
    """Start a run in a new folder (None: the next free runs/N), with robots of an earlier run or random ones.

    When this raises ConfigError or FolderError, no folder is left behind.
    """
    results = RunFolder.claim(folder, config)
    try:
        colony = _new_colony(results, beginning.founders if beginning else None)
        colony.start()
        results.create(colony.save(), beginning)
    except BaseException:  # Ctrl-C too
        results.discard()
        raise
    return results, colony


def resume_run(folder: Path, generations: int | None = None) -> tuple[RunFolder, InProcessColony]:
    """Resume a run from its checkpoint, with `generations` to that many, though it had fewer when it began.

    Raises FolderError if the checkpoint does not fit the config, or is of a later generation.
    """
    results, saved = RunFolder.resume(folder, generations)
    try:
        colony = _new_colony(results)
        colony.restore(saved)
    except (IndexError, KeyError, TypeError, ValueError) as error:
        results.close()
        raise FolderError(f"{folder / CHECKPOINT_FILE}: does not fit: {error}") from None
    return results, colony


def read_colony(folder: Path) -> InProcessColony:
    """Return the colony of a run's last checkpoint; it lives outside the folder, which stays as it is.

    Raises FolderError or ConfigError.
    """
    path = folder / "checkpoint.npz"
    try:
        colony = InProcessColony(load(folder / "config.toml"), lambda _: None)
        colony.restore(read_checkpoint(path))
    except (OSError, CheckpointError, IndexError, KeyError, TypeError, ValueError) as error:
        raise FolderError(f"{path}: holds no colony: {error}") from None
    return colony


def _new_colony(results: RunFolder, founders: Founders | None = None) -> InProcessColony:
    config = results.config
    needed = 2 * weight_bytes(
        config.robots, config.learning, config.life
    )  # a checkpoint copies all weights
    present = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    if needed > present:
        raise ConfigError(
            f"robots: {config.robots} robots of {config.life.agents} agents need"
            f" {needed / 1e9:.0f} GB of memory, this machine has {present / 1e9:.0f}"
        )
    try:
        return InProcessColony(config, results.add_event, founders)
    except ValueError as error:
        raise ConfigError(str(error)) from None
