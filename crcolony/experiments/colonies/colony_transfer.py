"""The best agent of a colony is born anew in two robots, of which the bodies may be others (Paper III, thesis 5.3)."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import msgspec
import numpy as np

from crcolony.compiled import FloatArray
from crcolony.config import Config
from crcolony.experiments.colonies.newborn_colony import newborn_colony
from crcolony.robot.state import Robots

ROBOTS = 2
"""As many Cyber Rodents as Paper III had."""


@dataclass(frozen=True)
class LearningCurves:
    """What an agent does in each slice of its life, mean over agents."""

    matings: FloatArray
    """(slices,)"""
    captures: FloatArray
    """(slices,)"""


def best_agent(config: Config, genotypes: FloatArray, seeds: Sequence[int]) -> FloatArray:
    """Return the genes of the agent, of these (robots, agents, genes), that is to conceive most in lives of a colony.

    These are its matings, weighted by the energy that it has then.
    """
    expected = np.zeros(genotypes.shape[:2])
    for seed in seeds:
        *_, batch = _lives(config, genotypes, seed)
        expected += batch.mating_energy_sum
    return np.array(genotypes[np.unravel_index(int(np.argmax(expected)), expected.shape)])


def learning_curves(config: Config, genes: FloatArray, seeds: Sequence[int]) -> LearningCurves:
    """Return how newborn agents learn that all have these genes, in arenas of as many seeds."""
    everyone = np.tile(genes, (config.robots, config.life.agents, 1))
    counts = np.zeros((2, config.life.slices + 1))
    for seed in seeds:
        for k, batch in enumerate(_lives(config, everyone, seed)):
            counts[:, k + 1] += batch.matings.mean(), batch.captures.mean()
    matings, captures = np.diff(counts / len(seeds), axis=1)
    return LearningCurves(matings, captures)


def _lives(config: Config, genotypes: FloatArray, seed: int) -> Iterator[Robots]:
    """Let newborn agents live, and yield the robots after each slice of all; of the last one a step is left out."""
    colony = newborn_colony(msgspec.structs.replace(config, seed=seed), genotypes)
    colony.start()
    steps = config.life.agents * config.life.slice_steps
    for k in range(config.life.slices):
        colony.run(steps - (k == config.life.slices - 1))
        yield colony.batch
