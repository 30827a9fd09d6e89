"""Each regime kills whom it should, and a population is over when it has died out or explodes."""

import numpy as np
import pytest

from crcolony.experiments.colonies import population_regimes
from crcolony.experiments.colonies.population_regimes import (
    EXPLODED,
    FOUNDERS,
    _next_agents,
    deaths_by_age,
    deaths_by_density,
    deaths_by_energy,
    deaths_by_fitness,
    run_colony_regime,
    run_free,
)
from crcolony.experiments.colonies.spatial_population import Population, founders


def population_of(count: int) -> Population:
    return founders(count, 0.5, np.random.default_rng(1))


def test_the_least_fit_die_as_many_as_are_too_many() -> None:
    """So that there are as many as founders; with fewer nobody dies."""
    population = population_of(FOUNDERS)
    population.matings[:] = np.arange(FOUNDERS)[::-1]
    rng = np.random.default_rng(2)
    assert np.flatnonzero(deaths_by_fitness(population, 3, rng)).tolist() == [27, 28, 29]
    assert not deaths_by_fitness(population_of(FOUNDERS - 5), 5, rng).any()


def test_age_kills_at_the_latest_at_the_end_of_a_lifespan() -> None:
    """And before with a probability that rises."""
    population = population_of(20_000)
    rng = np.random.default_rng(3)
    for age, expected in ((0, 0.25), (1, 0.5), (3, 1.0)):
        population.ages[:] = age
        assert abs(deaths_by_age(4.0)(population, 0, rng).mean() - expected) < 0.02


def test_density_kills_in_a_crowd_and_nobody_alone() -> None:
    """With certainty where there are six neighbours or more."""
    population = population_of(8)
    population.places[:7] = [0.99, 0.5] + 0.02 * np.arange(7)[:, None] * [1, 0]
    population.places %= 1.0
    population.places[7] = [0.5, 0.5]
    assert deaths_by_density(population, 0, np.random.default_rng(4)).tolist() == [True] * 7 + [
        False
    ]


def test_energy_kills_those_who_have_starved() -> None:
    """And nobody else."""
    population = population_of(3)
    population.is_alive[1] = False
    dies = deaths_by_energy(population, 0, np.random.default_rng(5))
    assert dies.tolist() == [False, True, False]


def test_selection_by_fitness_keeps_the_number() -> None:
    """In every generation."""
    course = run_free(deaths_by_fitness, False, 15, 5, np.random.default_rng(6))
    assert course.sizes == [FOUNDERS] * 5
    assert course.end == "completed"


@pytest.mark.parametrize(("dies", "end"), [(True, "extinct"), (False, "exploded")])
def test_a_run_ends_when_it_has_died_out_or_explodes(dies: bool, end: str) -> None:
    """At births without deaths, and at deaths without end."""
    course = run_free(
        lambda population, births, rng: np.full(len(population), dies),
        False,
        15,
        60,
        np.random.default_rng(7),
    )
    assert course.end == end
    assert len(course.sizes) == len(course.matings) == len(course.skills) < 60
    assert all(size <= EXPLODED for size in course.sizes)


def test_with_energy_births_cost_and_need_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where nobody has enough nobody is born."""
    monkeypatch.setattr(population_regimes, "BREEDING_ENERGY", 2.0)
    course = run_free(deaths_by_energy, True, 30, 4, np.random.default_rng(8))
    assert course.sizes == sorted(course.sizes, reverse=True)


def test_the_colony_draws_from_its_pools_or_goes_on_with_its_own() -> None:
    """Each robot for itself; runs are repeated by their seed."""
    rng = np.random.default_rng(9)
    pool = [np.array([0.1, 0.2]), np.array([0.3, 0.4])]
    drawn = _next_agents(np.zeros((50, 2)), pool, rng)
    assert {tuple(genes) for genes in drawn} == {(0.1, 0.2), (0.3, 0.4)}
    own = np.full((50, 2), 0.5)
    assert abs(_next_agents(own, [], rng) - own).max() < 0.3
    one, same = (run_colony_regime(15, 2, np.random.default_rng(1)) for _ in range(2))
    assert one == same
    assert one.end == "completed"
