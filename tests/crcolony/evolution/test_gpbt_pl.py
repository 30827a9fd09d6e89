"""GPBT-PL: the worst learn from the best in pairs, by a velocity: a table worked by hand."""

from typing import Any, cast

import numpy as np
import pytest

from crcolony.evolution.gpbt_pl import GpbtPl, next_velocity, pairs
from tests.support.mating_pairs import SCHEMA
from tests.support.scripted_randomness import ScriptedGenerator


def test_the_worst_quarter_learns_from_the_best() -> None:
    """Of eight instances two from two others, of which each may be drawn for both; of one none."""
    fitness = np.array([5.0, 1.0, 8.0, 4.0, 3.0, 9.0, 2.0, 6.0])
    slow, fast = pairs(fitness, cast(Any, ScriptedGenerator([[1, 0]])))
    assert slow.tolist() == [1, 6]
    assert fast.tolist() == [5, 2]
    assert pairs(np.array([1.0]), np.random.default_rng(1))[0].size == 0


def test_a_velocity_is_that_worked_by_hand() -> None:
    """0.5 · 2 + 0.25 · (8 - 4)."""
    one = np.array([1.0])
    assert next_velocity(2 * one, 4 * one, 8 * one, 0.5 * one, 0.25 * one).tolist() == [2.0]


def test_a_competition_goes_as_in_the_table_worked_by_hand() -> None:
    """The last of four learns from the first, twice: the second time the velocity of the first goes on."""
    competition = GpbtPl(SCHEMA, 4)
    genotypes = np.array([[4.0, 0.0, -8.0], [1.0] * 3, [2.0] * 3, [0.0, 0.0, 0.0]])
    fitness = np.array([9.0, 5.0, 5.0, 1.0])
    half, kept = [[0.5, 0.5, 0.5]], [[0.9, 0.9, 0.9]]
    script = ScriptedGenerator([[0], half, half, *([0.0] * 3), kept])
    learnt_from, genes = competition.compete(genotypes, fitness, cast(Any, Normals(script)))
    assert learnt_from.tolist() == [0, 1, 2, 0]
    assert genes[3].tolist() == [2.0, 0.0, -4.0]  # half the way
    assert np.array_equal(genes[:3], genotypes[:3])
    script = ScriptedGenerator([[0], half, half, *([0.0] * 3), [[0.9, 0.9, 0.1]]])
    _, genes = competition.compete(genes, fitness, cast(Any, Normals(script)))
    # 2 + 0.5 · 2 + 0.5 · (4 - 2); the third one is drawn anew: 0
    assert genes[3].tolist() == [4.0, 0.0, 0.0]
    assert competition.memory[3].tolist() == [2.0, 0.0, 0.0]


@pytest.mark.parametrize("instances", [4, 9, 80])
def test_genes_stay_in_their_ranges(instances: int) -> None:
    """However far velocities grow."""
    rng = np.random.default_rng(instances)
    competition = GpbtPl(SCHEMA, instances)
    genes = np.stack([SCHEMA.random(rng) for _ in range(instances)])
    for _ in range(50):
        learnt_from, genes = competition.compete(genes, rng.random(instances), rng)
        assert (abs(genes) <= 8.0).all()
        changed = np.count_nonzero(learnt_from != np.arange(instances))
        assert changed == min(-(-instances // 4), instances // 2)


class Normals:
    """A scripted generator whose initial genes are scripted, too."""

    def __init__(self, script: ScriptedGenerator) -> None:
        self.integers, self.random = script.integers, script.random
        self._script = script

    def normal(self, mean: float, sd: float) -> float:
        return float(self._script.random())
