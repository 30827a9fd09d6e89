"""Ways of breeding and dying that let a population live, die out or explode (arXiv 2604.26822), and this colony's own.

The paper's geckos, with HyperNEAT controllers in MuJoCo, are not here; its full text was not at hand. From its
abstract is taken what each regime couples: pairing by proximity in all of them, and death by fitness (deterministic),
by age (probabilistic), by energy that is found in zones, or by density. All numbers are ours. An individual has at
most one child in a generation as a mother. `colony` is Paper III: as many robots as there were individuals, each with
a few virtual agents that take turns; who mates conceives by its energy; the next agents are drawn from the robot's
pool.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from crcolony.compiled import FloatArray
from crcolony.experiments.colonies.spatial_population import (
    SKILL,
    Population,
    child_genes,
    founders,
    live,
    new_individuals,
    shortest,
)

FOUNDERS = 30
STEPS = 100
"""In a generation, for every individual"""
EXTINCT, EXPLODED = 2, 10 * FOUNDERS
"""Below the one, or above the other, a run is over"""
ZONES = 15
"""Where their number is not what is varied"""
BIRTH_ENERGY = 0.5
BREEDING_ENERGY, BREEDING_COST = 0.5, 0.2
"""What both need where energy decides on births, and what a birth costs each"""
NEIGHBOURHOOD = 0.15
CROWD = 6
"""So many neighbours are certain death where density kills"""
AGENTS = 4
"""Virtual agents of a robot of the colony"""

Deaths = Callable[[Population, int, np.random.Generator], NDArray[np.bool_]]
"""Returns which individuals die at the end of a generation, (N,), in which so many are born"""


@dataclass(frozen=True)
class Course:
    """What became of a population, generation by generation."""

    sizes: list[int]
    matings: list[float]
    """Of an individual"""
    skills: list[float]
    """Mean"""
    end: str
    """`completed`, `extinct` or `exploded`"""


def deaths_by_fitness(
    population: Population, births: int, rng: np.random.Generator
) -> NDArray[np.bool_]:
    """Let those with the fewest matings die, as many as are too many."""
    surplus = max(len(population) + births - FOUNDERS, 0)
    dies = np.zeros(len(population), dtype=np.bool_)
    dies[np.argsort(population.matings, kind="stable")[:surplus]] = True
    return dies


def deaths_by_age(lifespan: float) -> Deaths:
    """Let everyone die with a probability that rises with its age, and is 1 with a lifespan of so many generations."""

    def deaths(population: Population, births: int, rng: np.random.Generator) -> NDArray[np.bool_]:
        dies: NDArray[np.bool_] = rng.random(len(population)) < (population.ages + 1) / lifespan
        return dies

    return deaths


def deaths_by_density(
    population: Population, births: int, rng: np.random.Generator
) -> NDArray[np.bool_]:
    """Let everyone die with a probability that rises with the number of its neighbours."""
    ways = shortest(population.places[None] - population.places[:, None])
    neighbours = (np.hypot(ways[..., 0], ways[..., 1]) < NEIGHBOURHOOD).sum(axis=1) - 1
    dies: NDArray[np.bool_] = rng.random(len(population)) < neighbours / CROWD
    return dies


def deaths_by_energy(
    population: Population, births: int, rng: np.random.Generator
) -> NDArray[np.bool_]:
    """Let those die who have starved."""
    return ~population.is_alive


def run_free(
    deaths: Deaths, by_energy: bool, zones: int, generations: int, rng: np.random.Generator
) -> Course:
    """Run a population whose size is free, but where deaths hold it.

    With `by_energy` two breed only with enough energy, and without any one dies.
    """
    places = rng.random((zones, 2))
    population = founders(FOUNDERS, BIRTH_ENERGY, rng)
    sizes, matings, skills = [], [], []
    end = "completed"
    for _ in range(generations):
        newborn = _live_and_breed(population, places, by_energy, rng)
        sizes.append(len(population))
        matings.append(float(population.matings.mean()))
        skills.append(float(population.genes[:, SKILL].mean()))
        dies = deaths(population, len(newborn), rng)
        population.ages += 1
        population = population.part(~dies).joined(newborn)
        if len(population) < EXTINCT or len(population) > EXPLODED:
            end = "extinct" if len(population) < EXTINCT else "exploded"
            break
    return Course(sizes, matings, skills, end)


def _live_and_breed(
    population: Population, zones: FloatArray, by_energy: bool, rng: np.random.Generator
) -> Population:
    """Let a population live for a generation; return the newborns, each beside its mother."""
    has_bred = np.zeros(len(population), dtype=np.bool_)
    genes: list[FloatArray] = []
    places: list[FloatArray] = []

    def on_mating(one: int, other: int) -> None:
        pair = [one, other]
        if has_bred[one] or (by_energy and (population.energies[pair] < BREEDING_ENERGY).any()):
            return
        has_bred[one] = True
        if by_energy:
            population.energies[pair] -= BREEDING_COST
        genes.append(child_genes(population.genes[one], population.genes[other], rng))
        places.append(population.places[one].copy())

    live(population, zones, STEPS, by_energy, on_mating, rng)
    return new_individuals(
        np.reshape(places, (-1, 2)).astype(float),
        np.reshape(genes, (-1, 2)).astype(float),
        BIRTH_ENERGY,
    )


def run_colony_regime(zones: int, generations: int, rng: np.random.Generator) -> Course:
    """Run robots whose virtual agents reproduce by mating, by their own energy, within a fixed number of robots.

    A robot without offspring goes on with mutated copies; an agent that starves lies still until its turn is over.
    """
    places = rng.random((zones, 2))
    robots = founders(FOUNDERS, BIRTH_ENERGY, rng)
    genes = np.stack([founders(FOUNDERS, 1.0, rng).genes for _ in range(AGENTS)], axis=1)
    sizes, matings, skills = [], [], []
    for _ in range(generations):
        pools: list[list[FloatArray]] = [[] for _ in range(FOUNDERS)]
        count, alive = 0, 0
        for agent in range(AGENTS):
            robots = new_individuals(robots.places, genes[:, agent], BIRTH_ENERGY)
            live(robots, places, STEPS, True, _conceptions(robots, pools, rng), rng)
            count += int(robots.matings.sum())
            alive += int(robots.is_alive.sum())
        sizes.append(alive // AGENTS)
        matings.append(count / (FOUNDERS * AGENTS))
        skills.append(float(genes[..., SKILL].mean()))
        genes = np.stack(
            [_next_agents(own, pool, rng) for own, pool in zip(genes, pools, strict=True)]
        )
        if alive == 0:
            return Course(sizes, matings, skills, "extinct")
    return Course(sizes, matings, skills, "completed")


def _conceptions(
    robots: Population, pools: list[list[FloatArray]], rng: np.random.Generator
) -> Callable[[int, int], None]:
    """Return what happens at a mating: each side conceives, or not, by its own energy."""

    def on_mating(one: int, other: int) -> None:
        for own, partner in ((one, other), (other, one)):
            if rng.random() < robots.energies[own]:
                pools[own].append(child_genes(robots.genes[own], robots.genes[partner], rng))

    return on_mating


def _next_agents(own: FloatArray, pool: list[FloatArray], rng: np.random.Generator) -> FloatArray:
    """Return the next agents (agents, genes) of a robot: drawn from its pool, or mutated copies of its own."""
    if not pool:
        return child_genes(own, own, rng)
    return np.stack(pool)[rng.integers(len(pool), size=len(own))]
