"""Jobs on a Dask cluster: its scheduler gives what a dead worker had begun to another one."""

import contextlib
import logging
import re
import socket
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError
from importlib.metadata import version
from typing import Any

from crcolony.experiments.pools.worker_pool import ClusterError, WorkerPool

_CONNECT_S = 10.0


def version_here() -> str:
    """Return the version of this program where it is called."""
    return version("crcolony")


@contextlib.contextmanager
def dask_cluster(
    address: str, workers: int | None, jobs: int, _is_stopped: Callable[[], bool]
) -> Iterator[WorkerPool]:
    """Provide the cluster of a scheduler (`tcp://host:port`), with all jobs or `workers` at once in its hands.

    Workers may join later. What has not begun at the end is taken back. Raises ClusterError if there is no scheduler
    or no worker, if a worker has another version, or if the scheduler is gone; and ImportError without `distributed`.
    """
    try:
        from distributed import Client, KilledWorker
    except ImportError:
        raise ImportError(
            "--executor dask needs distributed: pip install 'crcolony[cluster]'"
        ) from None
    _check_address(address)
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # it prints tracebacks of its own
    try:
        client = Client(address, timeout=_CONNECT_S, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise ClusterError(
            f"--scheduler {address}: there is no scheduler: {_first_line(error)}"
        ) from None
    with client:
        check_workers(client, address)
        executor = client.get_executor(pure=False)
        try:
            yield WorkerPool(executor, min(workers or jobs, jobs))
        except CancelledError:
            raise ClusterError(
                f"the scheduler {address} is gone; what had finished is saved, and --resume goes on"
            ) from None
        except KilledWorker as error:
            raise ClusterError(
                f"workers died one after the other on the same run (out of memory?), the last was"
                f" {error.last_worker.address}; --resume goes on"
            ) from None


def _check_address(address: str) -> None:
    """Raise ClusterError unless something listens there: a client that finds nothing leaves a thread that may block."""
    found = re.fullmatch(r"(?:tcp|tls)://(\[[\w:.%]+\]|[\w.-]+):(\d{1,5})", address)
    if found is None:
        raise ClusterError(f"--scheduler {address}: not an address, as tcp://host:8786 is one")
    try:
        socket.create_connection((found[1].strip("[]"), int(found[2])), _CONNECT_S).close()
    except (OSError, OverflowError, UnicodeError) as error:
        raise ClusterError(f"--scheduler {address}: there is no scheduler: {error}") from None


def check_workers(client: Any, address: str) -> None:
    """Raise ClusterError unless there are workers, and all have this version."""
    try:
        found: dict[str, str] = client.run(version_here)
    except Exception as error:  # whatever importing this module raised there
        raise ClusterError(f"a worker of {address} cannot run this: {_first_line(error)}") from None
    if not found:
        raise ClusterError(
            f"the scheduler {address} has no workers; start some: dask worker {address}"
        )
    for worker, there in found.items():
        if there != version_here():
            raise ClusterError(f"the worker {worker} has crcolony {there}, not {version_here()}")


def _first_line(error: BaseException) -> str:
    return (str(error) or type(error).__name__).splitlines()[0]
