"""Where the jobs of an experiment run: on any `concurrent.futures.Executor`, here processes of this machine."""

import contextlib
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

from crcolony.experiments.usable_cpus import usable_cpus
from crcolony.experiments.worker_processes import ended_at_once, worker_processes

Result = TypeVar("Result")


def as_it_is(job: Callable[[], Result]) -> Callable[[], Result]:
    """Return a job as it is."""
    return job


@dataclass(frozen=True)
class WorkerPool:
    """An executor that is open."""

    executor: Executor
    workers: int
    """Jobs that run at once"""
    wrap: "Callable[[Callable[[], Result]], Callable[[], Result]]" = as_it_is
    """What is called there in place of a job"""


@contextlib.contextmanager
def processes(
    workers: int | None, jobs: int, is_stopped: Callable[[], bool]
) -> Iterator[WorkerPool]:
    """Provide processes of this machine, one a usable CPU if their number is None, and no more than there are jobs.

    After a stop they end at once: what they work on is lost. Raises WorkerError if one is killed from outside.
    """
    count = min(workers or usable_cpus(), jobs)
    with worker_processes(count, is_stopped) as executor:
        yield WorkerPool(executor, count, lambda job: partial(ended_at_once, job))
