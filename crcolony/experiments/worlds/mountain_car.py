"""The mountain car (Moore 1990), as in Sutton and Barto: an engine too weak for the hill it is on.

A state is (position, velocity). Every step is rewarded with -1; the goal ends the episode.
"""

import math

import numpy as np

from crcolony.compiled import FloatArray, compiled
from crcolony.randomness import Stream, draw

LOWEST_POSITION = -1.2
HIGHEST_POSITION = 0.6
GOAL_POSITION = 0.5
LARGEST_SPEED = 0.07
ACTIONS = 3
LOWEST_START, HIGHEST_START = -0.6, -0.4
"""Episodes start at rest between these positions, near the bottom."""
MOST_STEPS = 5_000
"""An episode is given up after so many steps, as in the program of Sutton and Barto's figures."""


@compiled
def drive(state: FloatArray, action: int) -> bool:
    """Move `state` (2,) by `action` 0 (back), 1 (coast) or 2 (forth); return whether it is the
    goal."""
    velocity = state[1] + (action - 1) * 0.001 - math.cos(3.0 * state[0]) * 0.0025
    velocity = min(max(velocity, -LARGEST_SPEED), LARGEST_SPEED)
    position = min(max(state[0] + velocity, LOWEST_POSITION), HIGHEST_POSITION)
    if position == LOWEST_POSITION and velocity < 0.0:
        velocity = 0.0
    state[0] = position
    state[1] = velocity
    return bool(position >= GOAL_POSITION)


@compiled
def draw_start(state: FloatArray, stream: Stream) -> None:
    """Put the car (2,) at rest where an episode starts."""
    state[0] = LOWEST_START + (HIGHEST_START - LOWEST_START) * draw(stream)
    state[1] = 0.0


def random_starts(episodes: int, rng: np.random.Generator) -> FloatArray:
    """Return positions (episodes,) at which episodes start."""
    return rng.uniform(LOWEST_START, HIGHEST_START, episodes)
