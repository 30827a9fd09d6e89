"""Algorithm 4.1, a genetic algorithm: the whole new population is selected from the old one."""

from collections.abc import Callable

import numpy as np

from crcolony.compiled import FloatArray, IntArray
from crcolony.evolution.variation import Crossover


def next_generation(
    population: FloatArray,
    fitness: FloatArray,
    select: Callable[[FloatArray, int, np.random.Generator], IntArray],
    crossover: Crossover,
    crossover_probability: float,
    mutate: Callable[[FloatArray, np.random.Generator], FloatArray],
    rng: np.random.Generator,
) -> FloatArray:
    """Return the population (N, genes) after one pass of Algorithm 4.1: select, pair at random,
    cross, mutate.

    `select` returns N indices into the population; with an odd N the last individual is not
    crossed.
    """
    size = population.shape[0]
    chosen = population[select(fitness, size, rng)]
    chosen = chosen[rng.permutation(size)]
    half = size // 2
    for i in range(half):
        if rng.random() < crossover_probability:
            chosen[i], chosen[i + half] = crossover(chosen[i], chosen[i + half], rng)
    return np.stack([mutate(genes, rng) for genes in chosen])


def evolve(
    population: FloatArray,
    evaluate: Callable[[FloatArray], float],
    breed: Callable[[FloatArray, FloatArray], FloatArray],
    generations: int,
) -> tuple[FloatArray, FloatArray]:
    """Repeat evaluation and breeding; return the last population (N, genes) and its fitness
    (N,)."""
    fitness = np.array([evaluate(genes) for genes in population])
    for _ in range(generations):
        population = breed(population, fitness)
        fitness = np.array([evaluate(genes) for genes in population])
    return population, fitness
