"""Many colonies run on an executor, each into its folder, and each run has an outcome."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import msgspec
import numpy as np
import pytest

from crcolony.config import ConfigError
from crcolony.experiments.sweep import read_outcome, run_all, run_once
from crcolony.results.generation_table import read_table
from crcolony.storage.files import FolderError
from tests.support.run_folders import run
from tests.support.small_colony import small


def test_a_folder_without_a_finished_run_is_refused(tmp_path: Path) -> None:
    """The line names the folder."""
    with pytest.raises(FolderError, match="not the results of a finished run"):
        read_outcome("implicit", tmp_path)


def test_an_outcome_is_read_from_the_tables_of_a_run(tmp_path: Path) -> None:
    """The first generation, and the mean of the last ones."""
    results = run(tmp_path, small("seed=5"))
    outcome = read_outcome("a name", tmp_path)
    rows = read_table(tmp_path / "generations.csv")
    assert (outcome.condition, outcome.seed) == ("a name", 5)
    assert outcome.history_hash == str(results.hash)
    assert outcome.matings_first == float(rows[0]["matings"])
    assert outcome.matings_end == np.mean([float(row["matings"]) for row in rows])
    assert outcome.mating_tau_end == np.mean([float(row["mating.tau q50"]) for row in rows])


def test_a_run_of_another_config_is_not_resumed(tmp_path: Path) -> None:
    """The line names the file."""
    run(tmp_path, small("seed=5"), stop_after=1)
    with pytest.raises(ConfigError, match=r"config\.toml: not the config of this comparison"):
        run_once("a name", small("seed=6"), tmp_path)


def test_all_jobs_run_until_a_stop(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each into the folder of its condition and seed; after a stop no outcome follows."""
    monkeypatch.setattr("crcolony.experiments.sweep.ShutdownSignal", lambda _: lambda: False)
    jobs = [("one name", small(f"seed={seed}", "generations=1")) for seed in (1, 2)]
    outcomes = list(run_all(ThreadPoolExecutor(1), jobs, tmp_path, lambda: False))
    assert sorted(outcome.seed for outcome in outcomes) == [1, 2]
    assert read_outcome("one name", tmp_path / "one-name" / "seed-2") in outcomes
    longer = [(name, msgspec.structs.replace(config, seed=3)) for name, config in jobs]
    assert list(run_all(ThreadPoolExecutor(1), longer, tmp_path, lambda: True)) == []
