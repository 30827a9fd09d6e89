"""Jobs go to the processes of an MPI run, which loses nothing that had finished; without one a line says how to start
it."""

import contextlib
import os
import signal
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType

import pytest

from crcolony.experiments.framework.run_experiment import Request, run_experiment
from crcolony.experiments.framework.tidy_table import read_rows
from crcolony.experiments.pools.mpi_pool import hold_interrupts, mpi_processes
from crcolony.experiments.pools.worker_pool import ClusterError
from tests.support.fake_experiment import REGISTRATION, fake_experiment, here_and_now
from tests.support.process import Process, wait_until

MPIEXEC = Path(sys.executable).parent / "mpiexec"
"""Of the package mpich"""
_ENDS_S = 60.0
"""In which an MPI run has ended"""


@contextlib.contextmanager
def mpi_run(log: Path, *words: str) -> Iterator[Process]:
    """Run the fake experiment with three processes, which are gone at the end of the context."""
    command = [str(MPIEXEC), "-n", "3", sys.executable, "-m", "mpi4py.futures"]
    run = Process([*command, "-m", "tests.support.mpi_experiment", *words], log).start()
    try:
        yield run
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(run.pid, signal.SIGKILL)
        run.kill()


class FakePool(ThreadPoolExecutor):
    """Has the face of mpi4py's executor, with threads for processes."""

    present = 3

    def __init__(self, workers: int | None, initializer: Callable[[], None], main: bool) -> None:
        assert not main, "workers would run the command, too"
        super().__init__(workers)

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
        assert pool.executor.submit(lambda: 6).result() == 6
    with mpi_processes(None, 9, lambda: False) as pool:
        assert pool.workers == 3


@pytest.mark.usefixtures("_mpi")
@pytest.mark.parametrize("is_idle", [True, False])
def test_interrupts_end_jobs_and_not_workers(is_idle: bool) -> None:
    """Ctrl-C is an exception of the job that runs, or of the next one, and of all later ones."""

    def interrupt() -> None:
        signal.raise_signal(signal.SIGINT)

    handler = signal.getsignal(signal.SIGINT)
    try:
        with mpi_processes(None, 1, lambda: False) as pool:
            hold_interrupts()  # as each worker does
            assert pool.wrap(lambda: 6)() == 6
            if is_idle:
                interrupt()
            for job in (interrupt, lambda: None, lambda: None):
                with pytest.raises(KeyboardInterrupt):
                    pool.wrap(job)()
    finally:
        signal.signal(signal.SIGINT, handler)


@pytest.mark.skipif(find_spec("mpi4py") is None or not MPIEXEC.exists(), reason="needs mpich")
def test_an_mpi_run_that_ends_early_loses_nothing(tmp_path: Path) -> None:
    """Three processes. A worker is killed: MPI ends all, and what had finished is there. It goes on, until Ctrl-C: one
    line says how to resume, and nothing is left. The rest may be done without MPI."""
    jobs, out = tmp_path / "jobs", tmp_path / "out"
    jobs.mkdir()
    journal = out / "jobs.jsonl"

    def wait_for_a_job() -> int:
        """Wait until one waits and another has finished; return the id of the process that has begun the former."""
        wait_until(lambda: any(file.read_text() for file in jobs.iterdir()), "a job has begun")
        wait_until(journal.read_text, "another has finished")
        return next(int(text) for file in jobs.iterdir() if (text := file.read_text()))

    with mpi_run(tmp_path / "killed.log", str(jobs), str(out)) as run:
        os.kill(wait_for_a_job(), signal.SIGKILL)
        assert run.wait(_ENDS_S) != 0
    finished = journal.read_text()
    assert 0 < finished.count("\n") < 8

    for file in jobs.iterdir():
        file.unlink()
    with mpi_run(tmp_path / "interrupted.log", str(jobs), str(out), "--resume") as run:
        wait_for_a_job()
        os.killpg(run.pid, signal.SIGINT)  # as a terminal does
        assert run.wait(_ENDS_S) == 0, run.output
        assert "stopped; resume with: crcolony experiment fake --resume" in run.output
        assert "Traceback" not in run.output
    assert journal.read_text().startswith(finished)

    request = Request(out=out, is_resumed=True)
    assert run_experiment(fake_experiment(), REGISTRATION, request, here_and_now) == 0
    assert len(read_rows(out)) == 8


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
