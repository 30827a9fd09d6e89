"""Jobs on the processes of an MPI run: `mpiexec -n 9 python -m mpi4py.futures -m crcolony experiment …`."""

import contextlib
from collections.abc import Callable, Iterator

from crcolony.experiments.pools.worker_pool import ClusterError, WorkerPool


@contextlib.contextmanager
def mpi_processes(
    workers: int | None, jobs: int, _is_stopped: Callable[[], bool]
) -> Iterator[WorkerPool]:
    """Provide the processes of this MPI run but this one, at most `workers` at once.

    If one dies, MPI ends them all, with this one; what had finished is saved. Raises ImportError without mpi4py, and
    ClusterError without an MPI library, or without processes to work.
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
    with MPIPoolExecutor(max_workers=workers) as executor:
        present = executor.num_workers
        if present < 1:
            raise ClusterError(
                "--executor mpi: no other processes; start as mpiexec -n 9 python -m mpi4py.futures -m crcolony …"
            )
        yield WorkerPool(executor, min(present, jobs))
        executor.shutdown(wait=False, cancel_futures=True)
