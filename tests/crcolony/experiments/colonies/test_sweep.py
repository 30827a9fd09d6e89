"""Many colonies run on an executor, each into its folder, and each run has an outcome."""

import json
import os
import signal
import threading
from concurrent.futures import Executor, Future
from pathlib import Path
from typing import Any

import pytest

from crcolony.config import ConfigError
from crcolony.experiments.colonies.outcomes import Outcome, read_outcome
from crcolony.experiments.colonies.sweep import run_all, run_once
from tests.support.process import wait_until
from tests.support.run_folders import run
from tests.support.small_colony import small


def test_a_run_of_another_config_is_not_resumed(tmp_path: Path) -> None:
    """The line names the file."""
    run(tmp_path, small("seed=5"), stop_after=1)
    with pytest.raises(ConfigError, match=r"config\.toml: not the config of this comparison"):
        run_once("a name", small("seed=6"), tmp_path)


class HereAndNow(Executor):
    """Runs a job in this process when its future is waited for, and notes how many were handed over at once."""

    def __init__(self) -> None:
        self.submitted: list[int] = []

    def submit(self, function: Any, /, *args: Any, **_: Any) -> Future[Any]:
        future: Future[Any] = Future()
        self.submitted.append(function.args[1].seed)
        future.set_result(function(*args))
        return future


def test_all_jobs_run_until_a_stop(tmp_path: Path) -> None:
    """Each into the folder of its condition and seed; after a stop none is handed to a worker any more."""
    jobs = [("one name", small(f"seed={seed}", "generations=1")) for seed in (1, 2, 3)]
    executor = HereAndNow()
    outcomes: list[Outcome] = []
    for outcome in run_all(executor, 2, jobs, tmp_path, lambda: len(outcomes) == 2):
        assert len(executor.submitted) <= len(outcomes) + 2, "more than there are workers"
        outcomes.append(outcome)
    assert sorted(outcome.seed for outcome in outcomes) == [1, 2]
    assert executor.submitted == [1, 2]
    assert read_outcome("one name", tmp_path / "one-name" / "seed-2") in outcomes
    resumed = list(run_all(HereAndNow(), 2, jobs, tmp_path, lambda: False))
    assert sorted(outcome.seed for outcome in resumed) == [1, 2, 3]


def test_a_run_that_is_stopped_is_saved_and_has_no_outcome(tmp_path: Path) -> None:
    """SIGTERM has its usual effect again afterwards."""
    before = signal.getsignal(signal.SIGTERM)

    def terminate_when_saved() -> None:
        wait_until((tmp_path / "run.json").exists, "a first checkpoint")
        os.kill(os.getpid(), signal.SIGTERM)

    threading.Thread(target=terminate_when_saved).start()
    assert run_once("a name", small("seed=5", "generations=0"), tmp_path) is None
    assert json.loads((tmp_path / "run.json").read_text())["status"] == "stopped"
    assert signal.getsignal(signal.SIGTERM) == before
