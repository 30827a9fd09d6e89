"""On the mountain car, Algorithm 2.2 learns as fast and as well as published results."""

import numpy as np
import pytest

from crcolony.compiled import IntArray
from crcolony.experiments.worlds.mountain_car import ACTIONS, random_starts
from crcolony.learning.features import TileCoding, uniform_offsets
from crcolony.learning.sarsa_learner import SarsaLambda
from tests.support.oracles.mountain_car import drive_episodes

SEEDS, EPISODES = 30, 500


@pytest.fixture(scope="module")
def steps() -> IntArray:
    """Return steps (seeds, episodes) of greedy learners, 8 tilings of 8 x 8, alpha 0.5, lambda
    0.9."""
    coding = TileCoding(
        np.array([-1.2, -0.07]), np.array([0.5, 0.07]), np.array([8, 8]), uniform_offsets(8, 2)
    )
    steps = np.zeros((SEEDS, EPISODES), dtype=np.int64)
    for seed in range(SEEDS):
        rng = np.random.default_rng(seed)
        learner = SarsaLambda(coding, ACTIONS, alpha=0.5, gamma=1.0, lambda_=0.9)
        starts, draws = random_starts(EPISODES, rng), rng.random(997)
        drive_episodes(learner.learner, np.zeros(2), starts, draws, steps[seed])
    return steps


def test_the_first_episodes_take_as_long_as_known_results(steps: IntArray) -> None:
    """The mean of the first 50 episodes is near 249 steps, that of an independent program."""
    assert 220 < steps[:, :50].mean() < 280


def test_the_last_episodes_are_nearly_optimal(steps: IntArray) -> None:
    """The last 50 of 500 episodes take 105 to 110 steps; dynamic programming reaches 97.7."""
    assert 105 < steps[:, -50:].mean() < 110
