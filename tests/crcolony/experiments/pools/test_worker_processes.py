"""Workers end when they are asked to and when what started them is gone, and run no file of the working folder."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import Executor
from pathlib import Path

import psutil
import pytest

from crcolony.experiments.pools.worker_processes import WorkerError, ended_at_once, worker_processes
from crcolony.shutdown import ShutdownSignal
from tests.support.paths import PYTHONPATH
from tests.support.process import wait_until


def work_until_stopped(folder: Path) -> int:
    """Write a file at the beginning, and one at the end, after a signal."""
    with ShutdownSignal() as stop:
        (folder / "begun").write_text(str(os.getpid()))
        while not stop():
            time.sleep(0.01)
        (folder / "saved").touch()
    return os.getpid()


def pid_in(folder: Path) -> int:
    """Wait until a worker has begun, and return its process id."""
    begun = folder / "begun"
    wait_until(lambda: begun.exists() and begun.read_text(), "a worker has begun")
    return int(begun.read_text())


def submitted(executor: Executor, folder: Path) -> int:
    executor.submit(work_until_stopped, folder)
    return pid_in(folder)


@pytest.mark.parametrize("ending", ["a stop", "an error"])
def test_workers_save_and_end_with_the_context(tmp_path: Path, ending: str) -> None:
    """After a stop, or an error here; an idle worker ends as well."""
    with (
        contextlib.suppress(KeyError),
        worker_processes(2, lambda: ending == "a stop") as executor,
    ):
        worker = psutil.Process(submitted(executor, tmp_path))
        if ending == "an error":
            raise KeyError
    assert not worker.is_running()
    assert (tmp_path / "saved").exists()


def test_ctrl_c_and_hangup_of_a_terminal_do_not_reach_workers(tmp_path: Path) -> None:
    """Not any of them, however late it was started: only the process that started them handles these."""
    folders = [tmp_path / str(number) for number in range(3)]
    stopped: list[bool] = []
    with worker_processes(3, lambda: bool(stopped)) as executor:
        for folder in folders:
            folder.mkdir()
            pid = submitted(executor, folder)
            os.kill(pid, signal.SIGINT)
            os.kill(pid, signal.SIGHUP)
        time.sleep(0.1)
        assert not any((folder / "saved").exists() for folder in folders)
        stopped.append(True)
    assert all((folder / "saved").exists() for folder in folders)


def test_a_worker_that_is_killed_is_one_line(tmp_path: Path) -> None:
    """As by the system when memory is short."""

    def work_and_kill() -> None:
        with worker_processes(1, lambda: False) as executor:
            future = executor.submit(work_until_stopped, tmp_path)
            os.kill(pid_in(tmp_path), signal.SIGKILL)
            future.result()

    with pytest.raises(WorkerError, match="a worker process was killed"):
        work_and_kill()


STARTS_WORKERS = """
import sys
from pathlib import Path
from crcolony.experiments.pools.worker_processes import worker_processes
from tests.crcolony.experiments.pools.test_worker_processes import work_until_stopped

if __name__ == "__main__":
    with worker_processes(2, lambda: True) as executor:
        executor.submit(work_until_stopped, Path(sys.argv[1])).result()
"""


def test_workers_save_and_end_when_their_parent_is_killed(tmp_path: Path) -> None:
    """The one that works, and the idle one; files of the working folder are no modules to them."""
    program = tmp_path / "program" / "sweep.py"
    program.parent.mkdir()
    program.write_text(STARTS_WORKERS)
    for name in ("queue", "socket", "pickle", "zenoh", "msgspec", "types"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('a file of the user was imported')")
    with subprocess.Popen(
        [sys.executable, str(program), str(tmp_path)],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": PYTHONPATH},
    ) as parent:
        pid_in(tmp_path)
        workers = psutil.Process(parent.pid).children(recursive=True)
        parent.kill()
    wait_until(lambda: not any(one.is_running() for one in workers), "all workers have ended")
    assert (tmp_path / "saved").exists()


def test_a_job_that_has_nothing_to_save_ends_with_sigterm_alone() -> None:
    """As it would by default; afterwards the signal has the effect again that it had before."""
    before = signal.getsignal(signal.SIGTERM)
    handler = ended_at_once(lambda: signal.getsignal(signal.SIGTERM))
    assert handler is signal.SIG_DFL
    assert signal.getsignal(signal.SIGTERM) == before
