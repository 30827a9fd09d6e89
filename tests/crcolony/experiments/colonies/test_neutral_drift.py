"""A meta-parameter that has moved further than neutral genes drift is found, and others are not."""

from pathlib import Path

import numpy as np
import pytest

from crcolony.experiments.colonies.neutral_drift import measure_drift
from crcolony.results.generation_table import read_table, write_table
from crcolony.results.neutral_gene import QUANTILES, neutral_medians
from crcolony.results.pedigree import read_pedigree
from crcolony.storage.files import FolderError
from tests.support.run_folders import run
from tests.support.small_colony import small


def test_the_end_of_runs_is_compared_with_that_of_neutral_genes(tmp_path: Path) -> None:
    """Means over runs, of the means over the last generations, of medians over agents."""
    configs = [small(f"seed={seed}", "generations=12") for seed in (1, 2)]
    folders = [tmp_path / str(config.seed) for config in configs]
    for folder, config in zip(folders, configs, strict=True):
        run(folder, config)
    drifts = measure_drift("a name", folders)
    assert len(drifts) == 10
    assert {drift.condition for drift in drifts} == {"a name"}
    (tau,) = [drift for drift in drifts if drift.gene == "mating.tau"]
    tables = [read_table(folder / "generations.csv")[2:] for folder in folders]
    ends = [np.mean([float(row["mating.tau q50"]) for row in table]) for table in tables]
    assert tau.evolved == pytest.approx(np.mean(ends))
    replicates = [
        neutral_medians(read_pedigree(folder), config, ["mating.tau"])["mating.tau"][2:12]
        for folder, config in zip(folders, configs, strict=True)
    ]
    expected = np.quantile(np.mean(replicates, axis=(0, 1)), QUANTILES)
    assert (tau.neutral_low, tau.neutral_high) == pytest.approx(expected)


def test_a_gene_that_was_driven_to_its_end_is_outside(tmp_path: Path) -> None:
    """And it alone: the others stay what they were."""
    run(tmp_path, small("generations=6"))
    before = measure_drift("a name", [tmp_path])
    table = tmp_path / "generations.csv"
    write_table(table, [{**row, "mating.tau q50": "0.001"} for row in read_table(table)])
    after = measure_drift("a name", [tmp_path])
    (driven,) = [drift for drift in after if drift.gene == "mating.tau"]
    assert driven.is_outside
    assert [d for d in after if d != driven] == [d for d in before if d.gene != "mating.tau"]


def test_runs_without_a_history_are_refused(tmp_path: Path) -> None:
    """The line names the file."""
    run(tmp_path, small())
    (tmp_path / "history.sqlite").unlink()
    with pytest.raises(FolderError, match=r"history\.sqlite"):
        measure_drift("a name", [tmp_path])
