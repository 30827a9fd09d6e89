"""A colony without a folder lives as one with a folder does."""

from pathlib import Path

import pytest

from crcolony.experiments.colonies.colony_run import founders_of, run_colony
from crcolony.experiments.colonies.neutral_drift import measure_drift
from crcolony.experiments.colonies.outcomes import read_outcome
from tests.support.run_folders import run
from tests.support.small_colony import small


def test_its_outcome_is_that_of_the_same_run_in_a_folder(tmp_path: Path) -> None:
    """Every number of it, the history hash, and its neutral genes."""
    config = small("seed=5", "generations=4")
    run(tmp_path, config)
    lived = run_colony(config)
    assert lived.genotypes.shape == (16, len(lived.colony.schema))
    neutral = lived.neutral_means(["mating.tau"])["mating.tau"]
    drift = next(one for one in measure_drift("a name", [tmp_path]) if one.gene == "mating.tau")
    assert drift.neutral_low < neutral < drift.neutral_high
    assert lived.outcome("a name") == pytest.approx(read_outcome("a name", tmp_path), nan_ok=True)


def test_a_population_founds_a_colony_under_a_name_of_its_own() -> None:
    """Robot by robot and agent by agent; their mothers are named so that no agent of the colony has the name."""
    lived = run_colony(small("seed=5", "generations=1"))
    genotypes = lived.colony.batch.genotypes
    founders = founders_of(genotypes.copy(), lived.colony.schema, "evolved")
    second = founders.of_robot(1, 4)
    assert [one.mother for one in second] == [f"1@evolved/{k}" for k in range(4)]
    assert all((one.genes == genes).all() for one, genes in zip(second, genotypes[1], strict=True))
