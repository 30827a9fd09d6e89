"""Runs many colonies, over seeds and conditions, on any `concurrent.futures.Executor`."""

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor
from functools import partial
from pathlib import Path

import msgspec

from crcolony.config import Config, ConfigError, load
from crcolony.experiments.colonies.outcomes import Outcome, read_outcome
from crcolony.experiments.pools.finished_jobs import finished_jobs
from crcolony.in_process.run import resume_run, run_until_done, start_run
from crcolony.shutdown import ShutdownSignal


def run_once(condition: str, config: Config, folder: Path) -> Outcome | None:
    """Run one colony to its end in a folder, or resume it there; this can run in any process.

    After a signal it stops and returns None; the run is saved, and can be resumed.
    """
    with ShutdownSignal() as stop:
        if (folder / "config.toml").exists():
            begun = load(folder / "config.toml")
            if msgspec.structs.replace(begun, generations=config.generations) != config:
                raise ConfigError(f"{folder / 'config.toml'}: not the config of this comparison")
            results, colony = resume_run(folder, config.generations)
        else:
            results, colony = start_run(folder, config)
        try:
            with stop.interruptible():
                colony.compile()
            is_over = run_until_done(results, colony, stop, lambda _: None)
        finally:
            results.close()
    return read_outcome(condition, folder) if is_over else None


def run_folder(out: Path, condition: str, seed: int) -> Path:
    """Return the folder of a run within that of a comparison."""
    return out / condition.replace(" ", "-") / f"seed-{seed}"


def run_all(
    executor: Executor,
    workers: int,
    jobs: Iterable[tuple[str, Config]],
    out: Path,
    is_stopped: Callable[[], bool],
) -> Iterator[Outcome]:
    """Run colonies of a condition and a config each, and yield outcomes as runs finish; after a stop start no more."""
    calls = (
        partial(run_once, name, config, run_folder(out, name, config.seed)) for name, config in jobs
    )
    for outcome in finished_jobs(executor, workers, calls, is_stopped):
        if outcome is None:
            return
        yield outcome
