"""Algorithm 4.1 solves a known problem, and makes a generation from the one before alone."""

import numpy as np

from crcolony.compiled import FloatArray, IntArray
from crcolony.evolution.genetic_algorithm import evolve, next_generation
from crcolony.evolution.selection import roulette, tournament
from crcolony.evolution.variation import bit_flip, one_point_crossover, uniform_crossover


def best_of_three(fitness: FloatArray, count: int, rng: np.random.Generator) -> IntArray:
    return tournament(fitness, count, 3, rng)


def flip(genes: FloatArray, rng: np.random.Generator) -> FloatArray:
    return bit_flip(genes > 0.5, 1 / genes.size, rng).astype(float)


def test_it_solves_one_max() -> None:
    """With tournament, crossover and bit flips, bit strings become all ones."""
    rng = np.random.default_rng(1)
    population = (rng.random((60, 40)) < 0.5).astype(float)
    last, fitness = evolve(
        population,
        lambda genes: float(genes.sum()),
        lambda old, fit: next_generation(
            old, fit, best_of_three, uniform_crossover, 0.9, flip, rng
        ),
        60,
    )
    assert last.shape == (60, 40)
    assert fitness.max() == 40.0
    assert fitness.mean() > 36.0


def test_the_whole_new_generation_is_selected_from_the_old_one() -> None:
    """No child of this generation is a parent in it, and the old one is unchanged."""
    population = np.arange(10.0).reshape(5, 2)
    kept = population.copy()
    parents = []

    def mutate(genes: FloatArray, _rng: np.random.Generator) -> FloatArray:
        parents.append(genes.copy())
        return genes + 100.0

    rng = np.random.default_rng(2)
    children = next_generation(
        population, np.ones(5), roulette, one_point_crossover, 1.0, mutate, rng
    )
    assert np.array_equal(population, kept)
    assert (np.array(parents) < 100.0).all()
    assert (children >= 100.0).all()
    assert children.shape == population.shape


def test_without_crossover_children_are_copies_of_the_selected() -> None:
    """With probability 0 and no mutation there is only selection."""
    population = np.arange(8.0).reshape(4, 2)
    fitness = np.array([0.0, 1.0, 0.0, 1.0])
    rng = np.random.default_rng(3)
    children = next_generation(
        population, fitness, roulette, one_point_crossover, 0.0, lambda genes, _: genes, rng
    )
    assert {tuple(child) for child in children} <= {(2.0, 3.0), (6.0, 7.0)}
