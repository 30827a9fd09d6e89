"""The outcome of a run is that of its tables and of its last population."""

import math
from pathlib import Path

import numpy as np
import pytest

from crcolony.experiments.colonies.energy_effect import measure_energy_effect
from crcolony.experiments.colonies.outcomes import read_outcome
from crcolony.in_process.run import resume_run
from crcolony.results.generation_table import read_table, write_table
from crcolony.storage.files import FolderError
from tests.support.run_folders import run
from tests.support.small_colony import small


def test_a_folder_without_a_finished_run_is_refused(tmp_path: Path) -> None:
    """The line names the folder, and what is wrong."""
    with pytest.raises(
        FolderError, match=r"not the results of a finished run: run\.json is missing"
    ):
        read_outcome("implicit", tmp_path)
    run(tmp_path, small())
    table = tmp_path / "generations.csv"
    rows = [{k: v for k, v in row.items() if k != "starved"} for row in read_table(table)]
    write_table(table, rows)
    with pytest.raises(FolderError, match="not the results of a finished run: 'starved'"):
        read_outcome("implicit", tmp_path)


def test_an_outcome_is_read_from_the_tables_of_a_run(tmp_path: Path) -> None:
    """The first generation, generations 5 to 14, and the mean of the last ten."""
    results = run(tmp_path, small("seed=5", "generations=13"))
    outcome = read_outcome("a name", tmp_path)
    rows = read_table(tmp_path / "generations.csv")
    assert (outcome.condition, outcome.seed) == ("a name", 5)
    assert outcome.history_hash == str(results.hash)
    assert outcome.matings_first == float(rows[0]["matings"])
    assert outcome.matings_early == np.mean([float(row["matings"]) for row in rows[5:13]])
    for measured, column in (
        (outcome.matings_end, "matings"),
        (outcome.energy_weighted_matings_end, "energy_weighted_matings"),
        (outcome.starved_end, "starved"),
        (outcome.mating_share_end, "mating_share"),
        (outcome.mating_tau_end, "mating.tau q50"),
        (outcome.mating_effective_tau_end, "mating.effective_tau q50"),
    ):
        assert measured == np.mean([float(row[column]) for row in rows[3:]]), column


def test_a_run_that_is_too_short_has_no_early_matings(tmp_path: Path) -> None:
    """They are NaN, and everything else is there."""
    run(tmp_path, small("generations=2"))
    outcome = read_outcome("a name", tmp_path)
    assert math.isnan(outcome.matings_early)
    assert outcome.matings_end > 0.0


def test_the_effect_of_energy_is_that_of_the_last_population(tmp_path: Path) -> None:
    """It is that of the run that goes on, and reading it changes nothing in the folder."""
    run(tmp_path, small("seed=3"))
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    outcome = read_outcome("a name", tmp_path)
    assert read_outcome("a name", tmp_path) == outcome
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before
    results, colony = resume_run(tmp_path)
    assert outcome.energy_effect == measure_energy_effect(colony).effect
    results.close()
