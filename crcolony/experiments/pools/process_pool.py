"""Jobs in processes of this machine."""

import contextlib
from collections.abc import Callable, Iterator
from functools import partial

from crcolony.experiments.pools.usable_cpus import usable_cpus
from crcolony.experiments.pools.worker_pool import WorkerPool
from crcolony.experiments.pools.worker_processes import ended_at_once, worker_processes


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
