"""What runs the jobs of an experiment: any `concurrent.futures.Executor` that is open."""

from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any

from crcolony.errors import CrcolonyError

OpenPool = Callable[[int, Callable[[], bool]], AbstractContextManager["WorkerPool"]]
"""Provides workers for so many jobs, until a stop."""


class ClusterError(CrcolonyError):
    """A cluster cannot be used, or is gone: the message says which, and what is left."""


def as_it_is(job: Callable[[], Any]) -> Callable[[], Any]:
    """Return a job as it is."""
    return job


@dataclass(frozen=True)
class WorkerPool:
    """An executor that is open."""

    executor: Executor
    workers: int
    """Jobs that it is handed at once"""
    wrap: Callable[[Callable[[], Any]], Callable[[], Any]] = as_it_is
    """What is called there in place of a job"""
