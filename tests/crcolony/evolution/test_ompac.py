"""OMPAC: instances are selected by their performance, with their learning, and get noise: a table worked by hand."""

from typing import Any, cast

import numpy as np
import pytest

from crcolony.evolution.ompac import Ompac, universal_sampling
from tests.support.scripted_randomness import ScriptedGenerator


@pytest.mark.parametrize(
    ("fitness", "spin", "selected"),
    [
        # a wheel of 8 with pointers every 2: at 1, 3, 5, 7 in slots that end at 1, 3, 6, 8
        ([1, 2, 3, 2], 0.5, [1, 2, 2, 3]),
        ([1, 2, 3, 2], 0.0, [0, 1, 2, 3]),
        ([1, 2, 3, 2], 0.49, [0, 1, 2, 3]),
        ([0, 8, 0, 0], 0.3, [1, 1, 1, 1]),
        ([0, 0, 0, 0], 0.3, [0, 1, 2, 3]),
    ],
)
def test_selection_is_that_of_the_table_worked_by_hand(
    fitness: list[float], spin: float, selected: list[int]
) -> None:
    """As often as its share says, rounded."""
    assert universal_sampling(np.array(fitness, dtype=float), spin).tolist() == selected


def test_everyone_is_selected_as_often_as_its_share_rounded() -> None:
    """Whatever the spin: nobody is lucky twice."""
    rng = np.random.default_rng(1)
    for _ in range(200):
        fitness = rng.random(12) * (rng.random(12) < 0.8)
        counts = np.bincount(universal_sampling(fitness, rng.random()), minlength=12)
        share = 12 * fitness / fitness.sum()
        assert (counts >= np.floor(share - 1e-9)).all()
        assert (counts <= np.ceil(share + 1e-9)).all()


def test_a_competition_goes_as_in_the_table_worked_by_hand() -> None:
    """Selected first, then with noise; the fittest twice, the others that are fit once, the unfit never."""
    noise = iter([0.0, 0.5, -0.5, 0.0])
    competition = Ompac(lambda genes, rng: genes + next(noise), 4)
    genotypes = np.array([[0.1, 10.0], [0.2, 20.0], [0.3, 30.0], [0.4, 40.0]])
    rng = cast(Any, ScriptedGenerator([0.5]))
    selected, genes = competition.compete(genotypes, np.array([2.0, 0.0, 4.0, 2.0]), rng)
    # a wheel of 8 with pointers at 1, 3, 5, 7 in slots that end at 2, 2, 6, 8
    assert selected.tolist() == [0, 2, 2, 3]
    assert genes.tolist() == [[0.1, 10.0], [0.8, 30.5], [-0.2, 29.5], [0.4, 40.0]]
