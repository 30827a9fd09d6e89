"""The selection of the central baseline draws with the right probabilities."""

import numpy as np
import pytest

from crcolony.evolution.selection import roulette, tournament

DRAWS = 40_000
RARE = 21.1
"""Chi square of 3 degrees: 99.99 % of fair draws stay below."""


def chi_square(drawn: np.ndarray, expected: np.ndarray) -> float:
    counts = np.bincount(drawn, minlength=expected.size)
    return float(((counts - DRAWS * expected) ** 2 / (DRAWS * expected)).sum())


def test_roulette_draws_in_proportion_to_fitness() -> None:
    """This is equation 4.1."""
    fitness = np.array([1.0, 5.0, 2.0, 0.5])
    drawn = roulette(fitness, DRAWS, np.random.default_rng(1))
    assert chi_square(drawn, fitness / fitness.sum()) < RARE


def test_roulette_never_draws_an_individual_without_fitness() -> None:
    """Unless all are without."""
    drawn = roulette(np.array([0.0, 1.0, 0.0, 2.0, 0.0]), DRAWS, np.random.default_rng(2))
    assert set(drawn) == {1, 3}


def test_roulette_without_any_fitness_is_uniform() -> None:
    """All individuals are equally likely."""
    drawn = roulette(np.zeros(4), DRAWS, np.random.default_rng(3))
    assert chi_square(drawn, np.full(4, 0.25)) < RARE


@pytest.mark.parametrize("fitness", [[1.0, -0.1], [1.0, np.nan], [np.inf, 1.0]])
def test_roulette_refuses_an_impossible_fitness(fitness: list[float]) -> None:
    """A negative one, or one that is not finite, raises ValueError."""
    with pytest.raises(ValueError):
        roulette(np.array(fitness), 1, np.random.default_rng(0))


def test_a_tournament_of_one_is_uniform_and_a_large_one_selects_the_best() -> None:
    """The larger the tournament, the stronger the selection."""
    fitness = np.array([3.0, 9.0, -4.0, 0.0])
    rng = np.random.default_rng(4)
    assert chi_square(tournament(fitness, DRAWS, 1, rng), np.full(4, 0.25)) < RARE
    assert set(tournament(fitness, 100, 200, rng)) == {1}


def test_a_tournament_of_two_prefers_by_rank() -> None:
    """The k-th best of n wins with probability ((n - k + 1)^2 - (n - k)^2) / n^2."""
    fitness = np.array([10.0, 1.0, 0.5, 100.0])
    drawn = tournament(fitness, DRAWS, 2, np.random.default_rng(5))
    assert chi_square(drawn, np.array([5, 3, 1, 7]) / 16) < RARE


def test_an_empty_tournament_is_refused() -> None:
    """A size below 1 raises ValueError."""
    with pytest.raises(ValueError, match="one individual or more"):
        tournament(np.ones(3), 1, 0, np.random.default_rng(0))
