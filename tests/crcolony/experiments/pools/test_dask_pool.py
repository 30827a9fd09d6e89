"""On a real Dask cluster a killed worker costs nothing, and a dead scheduler nothing that had finished."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import pytest

from crcolony.experiments.framework.experiment import Row
from crcolony.experiments.framework.run_experiment import Request, run_experiment
from crcolony.experiments.framework.tidy_table import read_rows
from crcolony.experiments.pools.dask_pool import check_workers, dask_cluster
from crcolony.experiments.pools.worker_pool import ClusterError
from tests.support.fake_experiment import (
    REGISTRATION,
    fake_experiment,
    here_and_now,
    number,
    slow_number,
    treated_wait,
)
from tests.support.paths import PYTHONPATH
from tests.support.process import wait_until

ROWS = [
    {"condition": condition, "seed": seed, **number(condition, seed)}
    for seed in (1, 2, 3, 4)
    for condition in ("control", "treated")
]


class Cluster:
    """A scheduler and two workers, processes of their own on loopback."""

    def __init__(self, folder: Path) -> None:
        file = folder / "scheduler.json"
        words = ("--host", "tcp://127.0.0.1", "--port", "0", "--no-dashboard")
        self.processes = [self._start("scheduler", *words, "--scheduler-file", str(file))]
        wait_until(lambda: file.exists() and file.read_text(), "a scheduler")
        self.address: str = json.loads(file.read_text())["address"]
        workers = ("worker", self.address, "--nthreads", "1", "--no-nanny", "--no-dashboard")
        self.processes += [self._start(*workers) for _ in range(2)]

    @property
    def scheduler(self) -> subprocess.Popen[bytes]:
        return self.processes[0]

    @staticmethod
    def _start(kind: str, *words: str) -> subprocess.Popen[bytes]:
        return subprocess.Popen(
            [sys.executable, "-m", f"distributed.cli.dask_{kind}", *words],
            stderr=subprocess.DEVNULL,
            env=os.environ | {"PYTHONPATH": PYTHONPATH},
        )

    def wait_for_workers(self) -> None:
        from distributed import Client

        with Client(self.address, set_as_default=False) as client:
            client.wait_for_workers(2, timeout=60)


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    started = Cluster(tmp_path)
    try:
        started.wait_for_workers()
        yield started
    finally:
        for process in started.processes:
            process.kill()
            process.wait()


@contextlib.contextmanager
def meanwhile(act: Callable[[], object]) -> Iterator[None]:
    """Do something beside the block, and see that it was done."""
    failed: list[BaseException] = []

    def run() -> None:
        try:
            act()
        except BaseException as error:
            failed.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    yield
    thread.join()
    assert not failed, failed


def run_on(cluster: Cluster, out: Path, job: Callable[[str, int], Row]) -> int:
    pool = partial(dask_cluster, cluster.address, None)
    return run_experiment(fake_experiment(job), REGISTRATION, Request(out=out), pool)


def begun(folder: Path) -> list[Path]:
    """Return the files of the jobs that have begun, with the process id in each."""
    return [path for path in folder.glob("*-*") if path.read_text()]


def test_a_cluster_that_dies_piece_by_piece_loses_nothing(cluster: Cluster, tmp_path: Path) -> None:
    """A worker is killed: all results are there. Then the scheduler: one line, and --resume does the rest."""
    jobs = tmp_path / "jobs"
    jobs.mkdir()

    def kill_worker() -> None:
        wait_until(lambda: len(begun(jobs)) == 2, "both workers have begun a job")
        os.kill(int(begun(jobs)[0].read_text()), signal.SIGKILL)
        (jobs / "go").touch()

    with meanwhile(kill_worker):
        assert run_on(cluster, tmp_path / "whole", partial(slow_number, jobs)) == 0
    assert read_rows(tmp_path / "whole") == ROWS

    out, others = tmp_path / "broken", tmp_path / "others"
    others.mkdir()
    journal = out / "jobs.jsonl"

    def kill_scheduler() -> None:
        wait_until(lambda: begun(others), "a job that waits has begun")
        wait_until(lambda: journal.read_text(), "another has finished")
        cluster.scheduler.kill()

    with (
        meanwhile(kill_scheduler),
        pytest.raises(ClusterError, match=f"the scheduler {cluster.address} is gone; what had"),
    ):
        run_on(cluster, out, partial(treated_wait, others))
    finished = journal.read_text().count("\n")
    assert 0 < finished < len(ROWS)
    request = Request(out=out, is_resumed=True)
    assert run_experiment(fake_experiment(), REGISTRATION, request, here_and_now) == 0
    assert read_rows(out) == ROWS


@pytest.mark.parametrize(
    "address",
    ["", "x", "nothing://y:1", "tcp://127.0.0.1:1", "tcp://[::1]:99999", f"tcp://{'n' * 99}:1"],
)
def test_an_address_without_a_scheduler_is_one_line(address: str) -> None:
    """Whatever is wrong with it."""
    with (
        pytest.raises(ClusterError, match=r"--scheduler .*: (not an|there is no)") as refused,
        dask_cluster(address, None, 1, lambda: False),
    ):
        pass
    assert "\n" not in str(refused.value)


def test_without_the_package_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """As for every other extra."""
    monkeypatch.setitem(sys.modules, "distributed", None)
    with (
        pytest.raises(ImportError, match=r"pip install 'crcolony\[cluster\]'"),
        dask_cluster("tcp://127.0.0.1:1", None, 1, lambda: False),
    ):
        pass


@pytest.mark.parametrize(
    ("there", "line"),
    [
        ({}, "the scheduler tcp://a:1 has no workers; start some: dask worker tcp://a:1"),
        ({"tcp://b:2": "0.0.1"}, "the worker tcp://b:2 has crcolony 0.0.1, not "),
        (
            ImportError("No module named 'crcolony'"),
            "a worker of tcp://a:1 cannot run this: No mod",
        ),
    ],
)
def test_workers_that_cannot_do_the_work_are_refused(there: object, line: str) -> None:
    """There are none, or they have another version of the program, or none."""

    class Client:
        def run(self, function: Callable[[], str]) -> object:
            if isinstance(there, Exception):
                raise there
            return there

    with pytest.raises(ClusterError) as refused:
        check_workers(Client(), "tcp://a:1")
    assert line in str(refused.value)
