"""Lives on the mountain car: Sarsa(lambda) with tile coding, softmax and a potential (Algorithm 2.2, eq. 3.1).

A life starts with nothing learnt. All lives of a generation are one call of compiled code. It checks once that arrays
have the sizes of this file; the compiler then takes these for constants, and unrolls the loops over them.
"""

from typing import NamedTuple

import numpy as np

from crcolony.compiled import FloatArray, IntArray, compiled
from crcolony.experiments.worlds.mountain_car import ACTIONS, MOST_STEPS, draw_start, drive
from crcolony.experiments.worlds.mountain_car_genes import (
    ALPHA,
    CENTRES,
    GAMMA,
    HIGH,
    LAMBDA,
    LOW,
    POTENTIAL,
    TAU,
    TAU_DECAY,
)
from crcolony.learning import sarsa_lambda
from crcolony.learning.features import TileCoding, uniform_offsets
from crcolony.learning.policies import hyperbolic_decay
from crcolony.learning.rbf_grid import RbfGrid, make_rbf_grid, rbf_grid_value
from crcolony.learning.sarsa_lambda import Learner, learn_and_select, start_episode
from crcolony.learning.sarsa_learner import SarsaLambda
from crcolony.learning.shaping import potential_shaping
from crcolony.randomness import Stream, draw

TILINGS = 8
TILES = 8
CODING = TileCoding(LOW, HIGH, np.array([TILES, TILES]), uniform_offsets(TILINGS, 2))
"""8 tilings of 8 x 8 tiles, as in Sutton and Barto's figures."""


class Driver(NamedTuple):
    """The arrays that a life needs; one life after another lives in them."""

    learner: Learner
    grid: RbfGrid
    state: FloatArray
    """(2,) position and velocity"""


def new_driver() -> Driver:
    """Return the arrays for lives."""
    learner = SarsaLambda(CODING, ACTIONS, alpha=0.0, gamma=1.0, lambda_=0.0).learner
    return Driver(learner, make_rbf_grid(LOW, HIGH, CENTRES), np.zeros(2))


@compiled
def live_all(driver: Driver, genotypes: FloatArray, stream: Stream, steps: IntArray) -> int:
    """Let each genotype (N, genes) live once; write the `steps` (N, episodes) of its episodes, and return their sum."""
    total = 0
    for row in range(genotypes.shape[0]):
        total += live(driver, genotypes[row], stream, steps[row])
    return total


@compiled
def live(driver: Driver, genes: FloatArray, stream: Stream, steps: IntArray) -> int:
    """Be born with these genes, and learn an episode for each of `steps` (episodes,), which are written; return their
    sum."""
    _forget(driver.learner)
    return learn(driver, genes, 0, stream, steps)


@compiled
def learn(
    driver: Driver, genes: FloatArray, first_episode: int, stream: Stream, steps: IntArray
) -> int:
    """Go on from what has been learnt in so many episodes, with these genes (genes,), for an episode for each of
    `steps` (episodes,), which are written; return their sum.

    Raises ValueError for a driver that `new_driver` has not made.
    """
    if not _has_known_sizes(driver):
        raise ValueError("not a driver of the mountain car")
    learner = driver.learner
    learner.meta_parameters[sarsa_lambda.RATE] = genes[ALPHA] / TILINGS
    learner.meta_parameters[sarsa_lambda.GAMMA] = genes[GAMMA]
    learner.meta_parameters[sarsa_lambda.GAMMA_LAMBDA] = genes[GAMMA] * genes[LAMBDA]
    has_potential = False
    for k in range(POTENTIAL, genes.shape[0]):
        has_potential |= genes[k] != 0.0
    total = 0
    for episode in range(steps.shape[0]):
        tau = hyperbolic_decay(genes[TAU], genes[TAU_DECAY], float(first_episode + episode))
        learner.meta_parameters[sarsa_lambda.TEMPERATURE] = tau
        count = _learn_episode(driver, genes[POTENTIAL:], has_potential, genes[GAMMA], stream)
        steps[episode] = count
        total += count
    sarsa_lambda.clear(learner)  # of an episode that was given up
    return total


@compiled
def _has_known_sizes(driver: Driver) -> bool:
    learner, grid, _ = driver
    return (
        learner.weights.shape[1] == learner.values.shape[0] == learner.scratch.shape[0] == ACTIONS
        and learner.active_tiles.shape[0] == learner.next_tiles.shape[0] == TILINGS
        and learner.tile_counts.shape[0] == learner.offsets.shape[1] == LOW.size
        and (grid.falloff_x.shape[0], grid.responses_y.shape[0]) == CENTRES
    )


@compiled
def _learn_episode(
    driver: Driver, weights: FloatArray, has_potential: bool, gamma: float, stream: Stream
) -> int:
    """Learn until the goal is reached, or the episode is given up; return the steps."""
    learner, grid, state = driver
    draw_start(state, stream)
    action = start_episode(learner, state, draw(stream))
    potential = rbf_grid_value(grid, state, weights) if has_potential else 0.0
    for count in range(MOST_STEPS):
        terminal = drive(state, action)
        potential_next = 0.0
        if has_potential and not terminal:
            potential_next = rbf_grid_value(grid, state, weights)
        reward = -1.0 + potential_shaping(gamma, potential_next, potential)
        action = learn_and_select(learner, action, reward, state, terminal, draw(stream))
        if terminal:
            return count + 1
        potential = potential_next
    return MOST_STEPS


@compiled
def _forget(learner: Learner) -> None:
    """Make a newborn learner: no weights, no traces."""
    for tile in range(learner.weights.shape[0]):
        for action in range(learner.weights.shape[1]):
            learner.weights[tile, action] = 0.0
        for column in range(learner.traces.shape[1]):
            learner.traces[tile, column] = 0.0
    learner.totals[0] = 1.0
    learner.totals[1] = 0.0
    learner.totals[2] = 0.0
