"""Evolution of learners of the mountain car by Algorithm 4.1, and how a learner does in lives of its own.

The fitness of an individual is how it does in one life, its mean steps of an episode with the sign turned: the thesis
does not say which one Paper IV used. So both a good start and fast progress pay. Numbers are ours.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np

from crcolony.compiled import FloatArray, IntArray
from crcolony.evolution.genetic_algorithm import next_generation
from crcolony.evolution.genotype import Schema
from crcolony.evolution.selection import tournament
from crcolony.evolution.variation import gaussian_mutation, one_point_crossover
from crcolony.experiments.worlds.mountain_car_genes import TAU, TAU_DECAY, car_schema
from crcolony.experiments.worlds.mountain_car_lives import Driver, live_all
from crcolony.randomness import Stream

CROSSOVER_PROBABILITY = 0.7
MUTATION_PROBABILITY = 0.1
"""Of a gene."""
TOURNAMENT = 3
"""Individuals, of which the fittest is selected."""
FINAL_LIVES = 10
"""Lives of each individual of the last generation, by which the best is chosen: one life has luck."""


@dataclass(frozen=True)
class CarSettings:
    """How large an evolutionary run is."""

    individuals: int
    generations: int
    episodes: int
    """In a life"""


@dataclass(frozen=True)
class Generation:
    """A generation after its lives, or after a part of them."""

    genotypes: FloatArray
    """(individuals, genes)"""
    steps: IntArray
    """(individuals, episodes)"""
    first_episode: int = 0
    """How many episodes they had learnt before"""

    @property
    def mean_steps(self) -> FloatArray:
        """Steps of an episode, mean over the life of each individual (individuals,)."""
        return np.asarray(self.steps.mean(axis=1))

    @property
    def fittest(self) -> FloatArray:
        """The genes (genes,) of the one with the fewest steps."""
        return np.asarray(self.genotypes[int(np.argmin(self.mean_steps))])

    @property
    def temperatures(self) -> FloatArray:
        """The temperature of each individual (individuals,), mean over these episodes."""
        episodes = self.first_episode + np.arange(self.steps.shape[1])
        tau, decay = (self.genotypes[:, gene, None] for gene in (TAU, TAU_DECAY))
        return np.asarray((tau / (1.0 + decay * episodes)).mean(axis=1))


class CarEvolution:
    """An evolutionary run: each `advance` lets a generation live, and breeds the next one.

    `rng` draws founders, selection and variation, `stream` is for all within lives.
    """

    def __init__(
        self,
        settings: CarSettings,
        shaping: bool,
        driver: Driver,
        rng: np.random.Generator,
        stream: Stream,
    ) -> None:
        self.schema: Schema = car_schema(shaping)
        self._settings = settings
        self._driver, self._rng, self._stream = driver, rng, stream
        self._genotypes = np.stack([self.schema.random(rng) for _ in range(settings.individuals)])

    def advance(self) -> Generation:
        """Let the present generation live, breed the next one, and return the former."""
        steps = np.zeros((self._settings.individuals, self._settings.episodes), dtype=np.int64)
        live_all(self._driver, self._genotypes, self._stream, steps)
        lived = Generation(self._genotypes, steps)
        self._genotypes = next_generation(
            lived.genotypes,
            -lived.mean_steps,
            lambda fitness, count, rng: tournament(fitness, count, TOURNAMENT, rng),
            one_point_crossover,
            CROSSOVER_PROBABILITY,
            partial(mutate, self.schema),
            self._rng,
        )
        return lived

    def choose_best(self, last: Generation) -> tuple[FloatArray, float]:
        """Return the genes (genes,) of the individual that does best in further lives, and its mean steps there."""
        totals = np.zeros(self._settings.individuals)
        steps = np.zeros_like(last.steps)
        for _ in range(FINAL_LIVES):
            live_all(self._driver, last.genotypes, self._stream, steps)
            totals += steps.sum(axis=1)
        best = int(np.argmin(totals))
        return last.genotypes[best], float(totals[best] / (FINAL_LIVES * steps.shape[1]))


def mutate(schema: Schema, genes: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return mutated genes (genes,)."""
    return gaussian_mutation(genes, schema, MUTATION_PROBABILITY, rng)


def live_often(
    driver: Driver, genes: FloatArray, lives: int, episodes: int, stream: Stream
) -> IntArray:
    """Return the steps (lives, episodes) of so many lives of one genotype."""
    steps = np.zeros((lives, episodes), dtype=np.int64)
    live_all(driver, np.tile(genes, (lives, 1)), stream, steps)
    return steps
