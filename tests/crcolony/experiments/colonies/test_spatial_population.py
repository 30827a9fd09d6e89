"""Individuals in a plane go where they should, eat, mate and starve as written."""

from itertools import pairwise

import numpy as np
import pytest

from crcolony.experiments.colonies import spatial_population
from crcolony.experiments.colonies.spatial_population import (
    CONTACT,
    REFRACTORY_STEPS,
    Population,
    child_genes,
    founders,
    live,
    new_individuals,
    shortest,
)

FAR = np.array([[0.5, 0.9]])


class FixedPlaces:
    """A generator that puts individuals where a test wants them; all else is random."""

    def __init__(self, places: list[list[float]]) -> None:
        self._places = np.array(places)
        self._rng = np.random.default_rng(1)
        self.uniform, self.standard_normal = self._rng.uniform, self._rng.standard_normal

    def random(self, shape: tuple[int, ...]) -> np.ndarray:
        """Return the places."""
        assert shape == self._places.shape
        return self._places


def lived(
    places: list[list[float]],
    threshold: float,
    steps: int,
    zones: np.ndarray = FAR,
    is_mortal: bool = True,
) -> tuple[Population, list[tuple[int, int]]]:
    """Return individuals of full skill and half their energy after some steps, and their matings."""
    matings: list[tuple[int, int]] = []
    genes = np.tile([1.0, threshold], (len(places), 1))
    population = new_individuals(np.array(places), genes, 0.5)
    live(
        population,
        zones,
        steps,
        is_mortal,
        lambda one, other: matings.append((one, other)),
        FixedPlaces(places),  # type: ignore[arg-type]
    )
    return population, matings


def test_the_hungry_go_to_the_nearest_zone_the_short_way_round() -> None:
    """At their speed; within it they gain energy, outside they lose some."""
    population, _ = lived([[0.95, 0.5]], 1.0, 5, np.array([[0.05, 0.5], [0.5, 0.5]]))
    assert population.places[0].round(6).tolist() == [0.0, 0.5]
    assert population.energies.round(6).tolist() == [0.44]
    population, _ = lived([[0.05, 0.5]], 1.0, 2, np.array([[0.05, 0.5]]))
    assert population.energies.round(6).tolist() == [0.576]


def test_the_others_go_to_each_other_and_mate_once() -> None:
    """Both are then refractory, and never mate with the same one twice in a row."""
    population, matings = lived([[0.3, 0.5], [0.36, 0.5]], 0.0, 30, is_mortal=False)
    assert matings == [(0, 1)]
    assert population.matings.tolist() == [1, 1]
    population, matings = lived([[0.3, 0.5], [0.36, 0.5], [0.44, 0.5]], 0.0, 2)
    assert matings == []
    assert population.places[:, 0].round(6).tolist() == [0.32, 0.34, 0.42]


def test_a_third_one_can_be_the_next_mate() -> None:
    """After the refractory time."""
    places = [[0.3, 0.5], [0.3 + CONTACT / 2, 0.5], [0.3, 0.5 + CONTACT / 2.1]]
    population, matings = lived(places, 0.0, 6 * REFRACTORY_STEPS, is_mortal=False)
    assert len(set(matings)) > 1
    assert all(one != other for one, other in pairwise(matings))
    assert population.matings.sum() == 2 * len(matings)


def test_the_mortal_die_without_energy_and_lie_still() -> None:
    """The others go on at none."""
    population, _ = lived([[0.1, 0.1]], 0.0, 60)
    assert not population.is_alive.any()
    where = population.places.copy()
    live(population, FAR, 5, True, lambda one, other: None, FixedPlaces(where.tolist()))  # type: ignore[arg-type]
    assert np.array_equal(population.places, where)
    population, _ = lived([[0.1, 0.1]], 0.0, 60, is_mortal=False)
    assert population.is_alive.all()
    assert population.energies.tolist() == [0.0]


def test_a_child_has_genes_of_both_parents_mutated(monkeypatch: pytest.MonkeyPatch) -> None:
    """Within 0 to 1."""
    rng = np.random.default_rng(3)
    children = np.stack([child_genes(np.zeros(2), np.ones(2), rng) for _ in range(200)])
    assert ((children >= 0.0) & (children <= 1.0)).all()
    monkeypatch.setattr(spatial_population, "MUTATION_SD", 0.0)
    children = np.stack([child_genes(np.zeros(2), np.ones(2), rng) for _ in range(200)])
    assert set(children.ravel()) == {0.0, 1.0}
    assert 0.4 < children.mean() < 0.6


def test_parts_and_joins_keep_every_row_together() -> None:
    """And the way across the border is the short one."""
    population = founders(5, 0.5, np.random.default_rng(4))
    joined = population.part(np.array([True, False, True, False, False])).joined(population)
    assert len(joined) == 7
    assert np.array_equal(joined.genes[:2], population.genes[[0, 2]])
    assert np.array_equal(joined.places[2:], population.places)
    assert shortest(np.array([0.9, -0.9, 0.2])).round(6).tolist() == [-0.1, 0.1, 0.2]
