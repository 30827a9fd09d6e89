"""Jobs go to the processes of an MPI run, and without one a line says how to start it."""

import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from types import ModuleType

import pytest

from crcolony.experiments.pools.mpi_pool import mpi_processes
from crcolony.experiments.pools.worker_pool import ClusterError


class FakePool(ThreadPoolExecutor):
    """Has the face of mpi4py's executor, with threads for processes."""

    present = 3

    @property
    def num_workers(self) -> int:
        return self.present


@pytest.fixture
def _mpi(monkeypatch: pytest.MonkeyPatch) -> None:
    futures = ModuleType("mpi4py.futures")
    futures.MPIPoolExecutor = FakePool  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "mpi4py", ModuleType("mpi4py"))
    monkeypatch.setitem(sys.modules, "mpi4py.futures", futures)


@pytest.mark.usefixtures("_mpi")
def test_jobs_run_on_all_processes_but_this_one() -> None:
    """No more at once than there are jobs."""
    with mpi_processes(None, 2, lambda: False) as pool:
        assert pool.workers == 2
        assert pool.executor.submit(pool.wrap(lambda: 6)).result() == 6
    with mpi_processes(None, 9, lambda: False) as pool:
        assert pool.workers == 3


@pytest.mark.usefixtures("_mpi")
def test_a_run_of_one_process_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the command that starts more."""
    monkeypatch.setattr(FakePool, "present", 0)
    with (
        pytest.raises(ClusterError, match="no other processes; start as mpiexec -n 9"),
        mpi_processes(None, 2, lambda: False),
    ):
        pass


@pytest.mark.parametrize("is_installed", [True, False])
def test_what_is_missing_is_named(monkeypatch: pytest.MonkeyPatch, is_installed: bool) -> None:
    """The package, or the library that it loads."""

    class Broken(ModuleType):
        def __getattr__(self, name: str) -> Callable[[], None]:
            raise RuntimeError("cannot load MPI library\nand much more")

    monkeypatch.setitem(sys.modules, "mpi4py", ModuleType("mpi4py"))
    broken = Broken("mpi4py.futures") if is_installed else None
    monkeypatch.setitem(sys.modules, "mpi4py.futures", broken)
    wrong, line = (
        (ClusterError, "cannot load MPI library$") if is_installed else (ImportError, "pip")
    )
    with pytest.raises(wrong, match=line), mpi_processes(None, 1, lambda: False):
        pass
