"""Jobs on the processes of an MPI run: `mpiexec -n 9 python -m mpi4py.futures -m crcolony experiment …`."""

import contextlib
import signal
from collections.abc import Callable, Iterator
from functools import partial
from types import FrameType
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
    with MPIPoolExecutor(workers, initializer=hold_interrupts, main=False) as executor:
        present = executor.num_workers
        if present < 1:
            raise ClusterError(
                "--executor mpi: no other processes; start as mpiexec -n 9 python -m mpi4py.futures -m crcolony …"
            )
        yield WorkerPool(executor, min(present, jobs), lambda job: partial(_interruptible, job))
        executor.shutdown(wait=False, cancel_futures=True)


class _Interrupts:
    """The handler of Ctrl-C in a worker: it ends the job that runs, or the next one, and all that follow.

    An idle worker goes on, since MPI would end all others with it. One that has ended a job takes no other, which it
    might be given before Ctrl-C has reached the main process.
    """

    def __init__(self) -> None:
        self.is_working = self.has_come = False

    def __call__(self, _number: int, _frame: FrameType | None) -> None:
        self.has_come = True
        if self.is_working:
            raise KeyboardInterrupt


def hold_interrupts() -> None:
    """Let Ctrl-C end jobs in this worker, and not the worker."""
    signal.signal(signal.SIGINT, _Interrupts())


def _interruptible(job: Callable[[], Result]) -> Result:
    """Call a job in a worker, which Ctrl-C ends: what came before it began counts, too."""
    interrupts = signal.getsignal(signal.SIGINT)
    assert isinstance(interrupts, _Interrupts)
    try:
        interrupts.is_working = True
        if interrupts.has_come:
            raise KeyboardInterrupt
        return job()
    finally:
        interrupts.is_working = False
