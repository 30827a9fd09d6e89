"""Making robots from their settings: one batch, the same for every way to run a colony."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from crcolony.evolution.founders import Founders
from crcolony.evolution.implicit_selection import ImplicitSelection
from crcolony.evolution.medea import Medea, equal_variance_sigma
from crcolony.evolution.pega import Pega
from crcolony.evolution.pgta import Pgta
from crcolony.evolution.population import Subpopulation
from crcolony.evolution.reproduction import CentrallyBred, ReproductionStrategy
from crcolony.evolution.time_sharing import (
    EpsilonGreedyOrder,
    RandomOrder,
    SoftmaxOrder,
    TimeSharing,
)
from crcolony.evolution.variation import Variation
from crcolony.randomness import new_streams
from crcolony.robot.batch import empty_robots, step_parameters
from crcolony.robot.energy import conception_probability
from crcolony.robot.genes import agent_schema
from crcolony.robot.robot import Robot
from crcolony.robot.settings import Heredity, Life, RobotSettings
from crcolony.robot.state import Robots, StepParameters


def make_robots(
    settings: RobotSettings,
    names: Sequence[str],
    streams: NDArray[np.uint64],
    founders: Founders | None = None,
) -> tuple[Robots, StepParameters, list[Robot]]:
    """Return robots that have not started; `names` go into the ids of their agents, `streams` is
    (robots, 2). They will begin with their share of `founders`; None: with random genotypes."""
    parameters = step_parameters(settings.learning, settings.life, settings.body)
    schema = agent_schema(settings.learning, settings.heredity)
    heredity = settings.heredity
    batch = empty_robots(len(names), parameters, settings.life.agents, len(schema), settings.seed)
    batch.streams[...] = streams
    variation = make_variation(heredity)
    robots = [
        Robot(
            batch,
            row,
            parameters,
            settings.life,
            Subpopulation(
                name,
                schema,
                variation,
                batch.genotypes[row],
                heredity.pool_limit,
                founders.of_robot(row, settings.life.agents) if founders else (),
            ),
            make_time_sharing(settings.life),
            make_reproduction(settings),
        )
        for row, name in enumerate(names)
    ]
    return batch, parameters, robots


def numbered_streams(seed: int, first: int, count: int) -> NDArray[np.uint64]:
    """Return the random streams of robots `first` to `first + count - 1` of a colony, shape (count,
    2)."""
    return new_streams(seed, (1,), first + count)[first:]


def own_streams(robots: Sequence[bytes]) -> NDArray[np.uint64]:
    """Return a random stream for each robot from its id, shape (robots, 2): for colonies without
    numbers."""
    return np.stack([new_streams(int.from_bytes(robot), (1,), 1)[0] for robot in robots])


def make_variation(heredity: Heredity) -> Variation:
    """Return crossover and mutation as set."""
    return Variation(heredity.crossover, heredity.mutation_probability)


def make_time_sharing(life: Life) -> TimeSharing:
    """Return the way of time sharing that is set."""
    if life.time_sharing == "epsilon_greedy":
        return EpsilonGreedyOrder(life.slices, life.exploration)
    if life.time_sharing == "softmax":
        return SoftmaxOrder(life.slices, life.exploration)
    return RandomOrder(life.slices)


def make_reproduction(settings: RobotSettings) -> ReproductionStrategy:
    """Return the way in which a robot reproduces by itself, for a setting of `selection`."""
    mutation_probability = settings.heredity.mutation_probability
    match settings.selection:
        case "pgta":
            return Pgta(mutation_probability)
        case "pega":
            return Pega()
        case "medea":
            return Medea(equal_variance_sigma(mutation_probability))
        case "ompac" | "gpbt_pl":
            return CentrallyBred()
        case "implicit" | "central":  # a baseline with the same matings
            return make_implicit_selection(settings.life)


def make_implicit_selection(life: Life) -> ImplicitSelection:
    """Return selection by mating, with the conceptions that are set."""
    return ImplicitSelection(
        partial(
            conception_probability,
            threshold=life.conception_threshold,
            exponent=life.conception_exponent,
        )
    )
