"""Making robots of a config: their minds in one batch, one row each, in whatever way a colony is run."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from crcolony.config import Config
from crcolony.evolution.population import Subpopulation
from crcolony.evolution.time_sharing import (
    EpsilonGreedyOrder,
    RandomOrder,
    SoftmaxOrder,
    TimeSharing,
)
from crcolony.evolution.variation import Variation
from crcolony.randomness import new_streams
from crcolony.robot.batch import empty_robots, step_parameters
from crcolony.robot.genes import agent_schema
from crcolony.robot.robot import Robot
from crcolony.robot.settings import Life
from crcolony.robot.state import Robots, StepParameters


def make_robots(
    config: Config, names: Sequence[str], streams: NDArray[np.uint64]
) -> tuple[Robots, StepParameters, list[Robot]]:
    """Return robots that have not begun to live; `names` go into the ids of their agents, `streams` is (robots, 2)."""
    parameters = step_parameters(config.learning, config.life, config.body)
    schema = agent_schema(config.learning, config.heredity)
    heredity = config.heredity
    batch = empty_robots(len(names), parameters, config.life.agents, len(schema), config.seed)
    batch.streams[...] = streams
    variation = variation_of(config)
    robots = [
        Robot(
            batch,
            row,
            parameters,
            config.life,
            Subpopulation(name, schema, variation, batch.genotypes[row], heredity.pool_limit),
            time_sharing_of(config.life),
        )
        for row, name in enumerate(names)
    ]
    return batch, parameters, robots


def numbered_streams(seed: int, first: int, count: int) -> NDArray[np.uint64]:
    """Return the randomness of robots `first` to `first + count - 1` of a colony, (count, 2), however they are run."""
    return new_streams(seed, (1,), first + count)[first:]


def own_streams(robots: Sequence[bytes]) -> NDArray[np.uint64]:
    """Return randomness that is each robot's own, from its id, (robots, 2): for colonies that nobody numbers."""
    return np.stack([new_streams(int.from_bytes(robot), (1,), 1)[0] for robot in robots])


def variation_of(config: Config) -> Variation:
    """Return crossover and mutation as a config has them."""
    return Variation(config.heredity.crossover, config.heredity.mutation_probability)


def time_sharing_of(life: Life) -> TimeSharing:
    """Return the way of time sharing that a config names."""
    if life.time_sharing == "epsilon_greedy":
        return EpsilonGreedyOrder(life.slices, life.exploration)
    if life.time_sharing == "softmax":
        return SoftmaxOrder(life.slices, life.exploration)
    return RandomOrder(life.slices)
