"""Runs an embedded colony into a results folder: generation by generation, until done or told to stop."""

import time
from collections.abc import Callable
from pathlib import Path

from crcolony.colony.embedded import EmbeddedColony
from crcolony.colony.results import Results, ResultsError
from crcolony.config import Config

_BREATH_TICKS = 2_000
"""Ticks between two looks at the clock and at a request to stop."""
_CHECKPOINT_S = 30.0

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
    generations = colony.config.generations
    saved_at = time.monotonic()
    while colony.generation < generations and not is_stopped():
        before = colony.generation
        colony.run(_BREATH_TICKS)
        if colony.generation > before:
            results.write_generation(colony.summary)
        progress(colony)
        if time.monotonic() - saved_at > _CHECKPOINT_S:
            results.write_checkpoint(colony.save(), colony.generation, "running")
            saved_at = time.monotonic()
    is_done = colony.generation >= generations
    results.write_checkpoint(colony.save(), colony.generation, "done" if is_done else "stopped")
    return is_done


def begin(folder: Path, config: Config) -> tuple[Results, EmbeddedColony]:
    """Start a new run in a new folder."""
    results = Results.create(folder, config)
    colony = EmbeddedColony(config, results.record)
    colony.begin()
    return results, colony


def resume(folder: Path) -> tuple[Results, EmbeddedColony]:
    """Go on with a run where its checkpoint stands; raises ResultsError if it does not fit its config."""
    results, saved = Results.resume(folder)
    colony = EmbeddedColony(results.config, results.record)
    try:
        colony.restore(saved)
    except (KeyError, TypeError, ValueError) as error:
        raise ResultsError(f"{folder / 'checkpoint.npz'}: does not fit: {error}") from None
    return results, colony
