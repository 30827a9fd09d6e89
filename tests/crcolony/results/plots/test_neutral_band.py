"""The band of a neutral gene is that of the runs it is drawn behind."""

import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from crcolony.results.neutral_gene import neutral_medians
from crcolony.results.pedigree import read_pedigree
from crcolony.results.plots.conditions import read_conditions
from crcolony.results.plots.neutral_band import neutral_bands
from tests.support.plotted_runs import cut

GENES = ("mating.tau", "foraging.gamma")


def test_the_band_has_nine_tenths_of_the_means_over_runs(comparison: Path) -> None:
    """Of the neutral genes along the pedigrees of its runs; of one run it is wider."""
    (condition,) = read_conditions([comparison / "implicit" / f"seed-{k}" for k in (1, 2, 3)])
    bands = neutral_bands(condition, GENES)
    assert list(bands) == list(GENES)
    for gene, band in bands.items():
        assert band.generation.tolist() == [0.0, 1.0, 2.0]
        means = np.mean(
            [
                neutral_medians(read_pedigree(run.folder), run.config, GENES)[gene][:3]
                for run in condition.runs
            ],
            axis=0,
        )
        inside = (means >= band.low[:, None]) & (means <= band.high[:, None])
        assert inside.mean(axis=1) == pytest.approx(0.9, abs=0.006)
    (single,) = read_conditions([comparison / "implicit" / "seed-1"])
    wider = neutral_bands(single, GENES)["mating.tau"]
    band = bands["mating.tau"]
    assert (wider.high - wider.low > band.high - band.low).all()


def test_a_run_counts_in_the_generations_that_it_has_ended(copy: Path) -> None:
    """The others alone make the band after that."""
    folders = [copy / "implicit" / f"seed-{k}" for k in (1, 2)]
    cut(folders[1], 1)
    (condition,) = read_conditions(folders)
    whole = read_conditions(folders[:1])[0]
    band = neutral_bands(condition, GENES)["mating.tau"]
    assert band.generation.tolist() == [0.0]
    alone = neutral_bands(whole, GENES)["mating.tau"]
    assert (band.high - band.low < alone.high[:1] - alone.low[:1]).all()


def test_there_is_no_band_where_the_parents_are_unknown(copy: Path) -> None:
    """As where founders came from another colony."""
    folder = copy / "implicit" / "seed-1"
    (condition,) = read_conditions([folder])
    assert neutral_bands(condition, GENES)
    with closing(sqlite3.connect(folder / "history.sqlite")) as database, database:
        database.execute("DELETE FROM births WHERE generation = 0")
    assert neutral_bands(condition, GENES) == {}
