"""Jobs on any `concurrent.futures.Executor`, their results as they finish."""

import itertools
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from typing import Any, TypeVar

Result = TypeVar("Result")

_POLL_S = 0.2
"""Time between two checks of a request to stop."""


def finished_jobs(
    executor: Executor,
    workers: int,
    jobs: Iterable[Callable[[], Result]],
    is_stopped: Callable[[], bool],
) -> Iterator[Result]:
    """Call jobs on an executor, and yield their results as they finish; after a stop start no more.

    An executor is handed as many jobs as it has workers, since it could not take back those that wait in its queue.
    A job that is interrupted is a stop, too. Raises what a job raises, after the results of others that had finished by
    then.
    """
    waiting = iter(jobs)
    running: set[Future[Result]] = set()
    while not is_stopped():
        for job in itertools.islice(waiting, workers - len(running)):
            running.add(executor.submit(job))
        if not running:
            return
        done, running = wait(running, _POLL_S, FIRST_COMPLETED)
        for future in sorted(done, key=_has_failed):
            if isinstance(future.exception(), KeyboardInterrupt):
                return  # Ctrl-C of an MPI run is for all processes, and has reached a worker first
            yield future.result()


def _has_failed(future: Future[Any]) -> bool:
    return future.cancelled() or future.exception() is not None
