"""Learners of foraging evolve by Algorithm 4.1, with the packs that they capture in a life as fitness (thesis 5.4)."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from crcolony.compiled import FloatArray, IntArray
from crcolony.config import Config
from crcolony.evolution.genetic_algorithm import next_generation
from crcolony.evolution.genotype import Schema
from crcolony.evolution.selection import tournament
from crcolony.evolution.variation import gaussian_mutation, one_point_crossover
from crcolony.experiments.colonies.foraging_lives import forage, foraging_schema

AGENTS = 20
TOURNAMENT, CROSSOVER_PROBABILITY, MUTATION_PROBABILITY = 3, 0.7, 0.1
FINAL_LIVES = 5
"""Lives of every agent of the last generation, by which the best is chosen."""


@dataclass(frozen=True)
class Generation:
    """A population that has lived."""

    genotypes: FloatArray
    """(agents, genes)"""
    packs: IntArray
    """(agents,) captured in a life"""


def evolve_foragers(
    config: Config, generations: int, rng: np.random.Generator
) -> Iterator[Generation]:
    """Yield generation after generation of agents, each of which has lived in an arena of its own."""
    schema = foraging_schema(config)
    genotypes = np.stack([schema.random(rng) for _ in range(config.life.agents)])
    for number in range(generations):
        packs = forage(config, genotypes, arena_seed(rng)).sum(axis=1)
        yield Generation(genotypes, packs)
        if number < generations - 1:
            genotypes = _breed(schema, genotypes, packs, rng)


def choose_best(config: Config, genotypes: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return the genes of the agent that captures most in further lives."""
    packs = sum(forage(config, genotypes, arena_seed(rng)) for _ in range(FINAL_LIVES))
    return np.asarray(genotypes[int(np.argmax(np.sum(packs, axis=1)))])


def arena_seed(rng: np.random.Generator) -> int:
    """Return the seed of another arena."""
    return int(rng.integers(2**62))


def _breed(
    schema: Schema, genotypes: FloatArray, packs: IntArray, rng: np.random.Generator
) -> FloatArray:
    return next_generation(
        genotypes,
        packs.astype(np.float64),
        lambda fitness, count, rng: tournament(fitness, count, TOURNAMENT, rng),
        one_point_crossover,
        CROSSOVER_PROBABILITY,
        lambda genes, rng: gaussian_mutation(genes, schema, MUTATION_PROBABILITY, rng),
        rng,
    )
