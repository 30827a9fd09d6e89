"""Jobs on the processes of an MPI run: `mpiexec -n 9 python -m mpi4py.futures -m crcolony experiment …`."""

import contextlib
import signal
from collections.abc import Callable, Iterator
from functools import partial
from typing import TypeVar

from crcolony.experiments.pools.worker_pool import ClusterError, WorkerPool

Result = TypeVar("Result")


@contextlib.contextmanager
def mpi_processes(
    workers: int | None, jobs: int, _is_stopped: Callable[[], bool]
) -> Iterator[WorkerPool]:
    """Provide the processes of this MPI run but this one, at most `workers` at once.

    If one dies, MPI ends them all, with this one; what had finished is saved. Ctrl-C reaches them all, and ends what
    they work on. Raises ImportError without mpi4py, and ClusterError without an MPI library or processes to work.
    """
    try:
        from mpi4py.futures import MPIPoolExecutor
    except ImportError:
        raise ImportError(
            "--executor mpi needs mpi4py, and an MPI library: pip install mpi4py"
        ) from None
    except RuntimeError as error:
        raise ClusterError(
            f"--executor mpi: no MPI library: {str(error).splitlines()[0]}"
        ) from None
    # The main module is the command `crcolony`, which is not for workers.
    with MPIPoolExecutor(workers, initializer=_hold_interrupts, main=False) as executor:
        present = executor.num_workers
        if present < 1:
            raise ClusterError(
                "--executor mpi: no other processes; start as mpiexec -n 9 python -m mpi4py.futures -m crcolony …"
            )
        yield WorkerPool(executor, min(present, jobs), lambda job: partial(_interruptible, job))
        executor.shutdown(wait=False, cancel_futures=True)


def _hold_interrupts() -> None:
    """Let Ctrl-C wait: it would end an idle worker, and MPI all others with it."""
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})


def _interruptible(job: Callable[[], Result]) -> Result:
    """Call a job in a worker, which Ctrl-C ends: what came before it began counts, too.

    After that the worker does no other job, which it might be given before Ctrl-C has reached the main process.
    """
    try:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        return job()
    except KeyboardInterrupt:
        _hold_interrupts()
        signal.raise_signal(signal.SIGINT)  # waits for the next job
        raise
    finally:
        _hold_interrupts()
