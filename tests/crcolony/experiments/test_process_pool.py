"""Jobs run in processes of this machine, which lose at a stop only what they work on."""

import time
from functools import partial
from pathlib import Path

import psutil

from crcolony.experiments.process_pool import processes
from tests.support.fake_experiment import number, slow_number
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
