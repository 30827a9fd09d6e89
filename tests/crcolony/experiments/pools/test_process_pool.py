"""Jobs run in processes of this machine, which lose at a stop only what they work on."""

import threading
import time
from functools import partial
from pathlib import Path

import psutil
import pytest

from crcolony.experiments.framework.run_experiment import Request, run_experiment
from crcolony.experiments.framework.tidy_table import read_rows
from crcolony.experiments.pools.process_pool import processes
from crcolony.experiments.pools.worker_processes import WorkerError
from tests.support.fake_experiment import (
    REGISTRATION,
    fake_experiment,
    here_and_now,
    number,
    slow_number,
    treated_wait,
)
from tests.support.process import wait_until


def test_jobs_run_in_other_processes() -> None:
    """No more of them than there are jobs."""
    with processes(3, 2, lambda: False) as pool:
        assert pool.workers == 2
        futures = [pool.executor.submit(pool.wrap(partial(number, "a", seed))) for seed in (1, 2)]
        assert [future.result() for future in futures] == [number("a", 1), number("a", 2)]


def test_a_stop_ends_a_job_that_has_nothing_to_save_at_once(tmp_path: Path) -> None:
    """It does not wait for its end, and no process is left."""
    with processes(1, 1, lambda: True) as pool:
        pool.executor.submit(pool.wrap(partial(slow_number, tmp_path, "a", 1)))
        begun = tmp_path / "a-1"
        wait_until(lambda: begun.exists() and begun.read_text(), "a job has begun")
        worker = psutil.Process(int(begun.read_text()))
        stopped_s = time.monotonic()
    assert time.monotonic() - stopped_s < 10.0
    assert not worker.is_running()


def test_a_worker_that_is_killed_loses_nothing_that_had_finished(tmp_path: Path) -> None:
    """One line, and --resume does the rest, which is what it worked on."""
    out = tmp_path / "out"
    begun = tmp_path / "treated-1"

    def kill() -> None:
        wait_until(lambda: begun.exists() and begun.read_text(), "a job that waits has begun")
        psutil.Process(int(begun.read_text())).kill()

    killer = threading.Thread(target=kill)
    killer.start()
    with pytest.raises(WorkerError, match="--resume goes on"):
        run_experiment(
            fake_experiment(partial(treated_wait, tmp_path)),
            REGISTRATION,
            Request(out=out),
            partial(processes, 1),
        )
    killer.join()
    assert (out / "jobs.jsonl").read_text().count("\n") == 1
    request = Request(out=out, is_resumed=True)
    assert run_experiment(fake_experiment(), REGISTRATION, request, here_and_now) == 0
    assert len(read_rows(out)) == 8
