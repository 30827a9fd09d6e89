"""Foragers and trackers are told apart, and made, as the selector of a robot would choose."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from crcolony.compiled import FloatArray
from crcolony.config import Config
from crcolony.experiments.colonies.mating_strategy import (
    FORAGER,
    OTHER,
    TRACKER,
    as_forager,
    as_tracker,
    mating_range_of,
    strategies_of,
    threshold_of,
)
from crcolony.robot.genes import agent_schema
from crcolony.robot.step import select_module

SCHEMA = agent_schema(Config().learning, Config().heredity)
BOTH = np.ones(2)
FORAGES, TRACKS = 0, 1

weights = st.tuples(*[st.floats(-3.0, 3.0)] * 4)


def genes_with(bias: float, energy: float, battery: float, mate: float) -> FloatArray:
    genes = np.zeros(len(SCHEMA))
    genes[:4] = bias, energy, battery, mate
    return genes


def choice(genes: FloatArray, energy: float) -> int:
    """Return the module that a robot selects which sees both."""
    return int(select_module(genes, energy, BOTH, 2))


@pytest.mark.parametrize(
    ("selector", "expected"),
    [
        ((-1.0, 0.5, 0.0, 0.0), FORAGER),
        ((-0.5, 1.0, 0.0, 0.0), TRACKER),
        ((1.0, 0.0, 0.0, 0.0), TRACKER),
        ((0.5, -1.0, 0.0, 0.0), OTHER),
        ((0.5, 0.0, -2.0, 1.0), FORAGER),
    ],
)
def test_a_strategy_is_what_a_robot_does_that_sees_both(
    selector: tuple[float, float, float, float], expected: str
) -> None:
    """A forager never follows the mate, a tracker does with enough energy, any other only when it is hungry."""
    genes = genes_with(*selector)
    assert strategies_of(genes[None], SCHEMA).tolist() == [expected]
    full, hungry = choice(genes, 1.0), choice(genes, 0.0)
    assert full == (TRACKS if expected == TRACKER else FORAGES)
    assert hungry == FORAGES or expected != FORAGER


@given(weights)
def test_a_tracker_follows_the_mate_from_its_threshold_on(
    selector: tuple[float, float, float, float],
) -> None:
    """A little above it does, a little below it does not."""
    genes = as_tracker(genes_with(*selector), SCHEMA)
    threshold = threshold_of(genes, SCHEMA)
    assert choice(genes, 1.0) == TRACKS
    assert 0.0 <= threshold < 1.0 + 1e-9
    above, below = threshold + 0.01, threshold - 0.01
    if genes[1] > 0.01 and above <= 1.0:
        assert choice(genes, above) == TRACKS
    if genes[1] > 0.01 and threshold > 0.01:
        assert choice(genes, below) == FORAGES


@given(weights)
def test_who_is_made_the_other_differs_in_one_gene_alone(
    selector: tuple[float, float, float, float],
) -> None:
    """A forager stays as it is, and so does a tracker; else the attention to batteries changes, and nothing else."""
    genes = genes_with(*selector)
    strategy = strategies_of(genes[None], SCHEMA)[0]
    forager, tracker = as_forager(genes, SCHEMA), as_tracker(genes, SCHEMA)
    assert strategies_of(np.array([forager, tracker]), SCHEMA).tolist() == [FORAGER, TRACKER]
    assert {int(k) for k in np.flatnonzero(forager != genes)} <= {2}
    assert {int(k) for k in np.flatnonzero(tracker != genes)} <= {2}
    if strategy == TRACKER:
        assert np.array_equal(tracker, genes)


def test_one_that_is_made_a_tracker_tracks_from_the_middle_on() -> None:
    """Where its drive to mate rises with energy."""
    tracker = as_tracker(genes_with(-2.0, 1.0, 0.0, 0.0), SCHEMA)
    assert threshold_of(tracker, SCHEMA) == pytest.approx(0.5, abs=1e-3)


@settings(max_examples=40)
@given(weights, st.booleans(), st.booleans())
def test_a_mating_range_is_how_many_of_all_energies_choose_to_mate(
    selector: tuple[float, float, float, float], battery: bool, mate: bool
) -> None:
    """As the selector of a robot chooses, whatever is in sight."""
    genes = genes_with(*selector)
    seen = np.array([battery, mate], dtype=np.float64)
    energies = (np.arange(100) + 0.5) / 100
    chosen = [select_module(genes, energy, seen, 2) == TRACKS for energy in energies.tolist()]
    found = mating_range_of(genes[None], SCHEMA, battery, mate)
    assert found.shape == (1,)
    assert found[0] == pytest.approx(np.mean(chosen), abs=0.011)
