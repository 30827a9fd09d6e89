"""The mountain car (Moore 1990), as in Sutton and Barto: an engine too weak for the hill it is on.

A state is (position, velocity). Every step is rewarded with -1; the goal ends the episode.
"""

import math

import numpy as np

from crcolony.compiled import FloatArray, IntArray, compiled
from crcolony.learning.sarsa_lambda import Learner, learn_and_select, start_episode

LOWEST_POSITION = -1.2
HIGHEST_POSITION = 0.6
GOAL_POSITION = 0.5
LARGEST_SPEED = 0.07
ACTIONS = 3


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


def random_starts(episodes: int, rng: np.random.Generator) -> FloatArray:
    """Return positions (episodes,) near the bottom, where episodes start at rest."""
    return rng.uniform(-0.6, -0.4, episodes)


@compiled
def drive_episodes(
    learner: Learner, state: FloatArray, starts: FloatArray, draws: FloatArray, steps: IntArray
) -> int:
    """Learn an episode from each of the positions `starts` (episodes,); return the steps of all.

    Writes the `steps` (episodes,) of each, at most 5000. `draws` (any,) are used in turn.
    """
    total = 0
    for episode in range(starts.shape[0]):
        state[0] = starts[episode]
        state[1] = 0.0
        action = start_episode(learner, state, draws[total % draws.shape[0]])
        count = 0
        while action >= 0 and count < 5000:
            terminal = drive(state, action)
            count += 1
            total += 1
            action = learn_and_select(
                learner, action, -1.0, state, terminal, draws[total % draws.shape[0]]
            )
        steps[episode] = count
    return total
