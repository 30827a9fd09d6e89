"""The mountain car is that of Gymnasium, and of Sutton and Barto."""

import numpy as np
import pytest
from gymnasium.envs.classic_control.mountain_car import MountainCarEnv

from crcolony.experiments.worlds.mountain_car import ACTIONS, draw_start, drive, random_starts
from crcolony.experiments.worlds.mountain_car_lives import CODING
from crcolony.learning.sarsa_learner import SarsaLambda
from crcolony.randomness import new_streams
from tests.support.oracles.mountain_car_optimum import interpolate, optimal_values


def test_the_car_moves_like_that_of_gymnasium() -> None:
    """With the same actions, both cars are in the same state in every step, up to the goal."""
    reference = MountainCarEnv()
    rng = np.random.default_rng(6)
    goals = 0
    for episode in range(20):
        reference.reset(seed=episode)
        state = np.array(reference.state, dtype=np.float64)
        for _ in range(500):
            # driving with the velocity, with some noise, reaches both walls and the goal
            action = 2 if state[1] > 0.0 else 0
            if rng.random() < 0.1:
                action = int(rng.integers(3))
            _, _, terminal, _, _ = reference.step(action)
            assert drive(state, action) == terminal
            assert state.tolist() == pytest.approx(list(reference.state), rel=0.0, abs=1e-12)
            if terminal:
                goals += 1
                break
    assert goals == 20


def test_episodes_start_at_rest_near_the_bottom() -> None:
    """Anywhere from -0.6 to -0.4, whichever generator draws."""
    state, stream = np.ones(2), new_streams(1, (1,), 1)[0]
    positions = []
    for _ in range(1000):
        draw_start(state, stream)
        assert state[1] == 0.0
        positions.append(float(state[0]))
    for starts in (np.array(positions), random_starts(1000, np.random.default_rng(1))):
        assert -0.6 <= starts.min() < -0.59
        assert -0.41 < starts.max() <= -0.4


@pytest.mark.slow
@pytest.mark.parametrize(
    ("c", "first", "early"), [(0.5, (330, 480), (170, 225)), (1.0, (98, 135), (98, 113))]
)
def test_the_optimal_values_as_a_potential_make_learning_fast(
    c: float, first: tuple[float, float], early: tuple[float, float]
) -> None:
    """With c V* as the potential the first episode takes 403 or 123 steps, and the first 20 take 197 or 108 on average,
    as an independent program has it, with values that are a little rougher; without one it is 1,701 and 426."""
    values = c * optimal_values()
    steps = np.zeros((8, 20))
    for seed, row in enumerate(steps):
        rng = np.random.default_rng(seed)
        learner = SarsaLambda(CODING, ACTIONS, alpha=0.5, gamma=1.0, lambda_=0.0)
        for episode, start in enumerate(random_starts(20, rng)):
            state, terminal = np.array([start, 0.0]), False
            potential = float(interpolate(values, state[:1], state[1:])[0])
            action = learner.start(state, rng.random())
            while not terminal:
                terminal = drive(state, action)
                following = 0.0 if terminal else float(interpolate(values, state[:1], state[1:])[0])
                reward = -1.0 + following - potential
                action = learner.step(reward, state, terminal, rng.random())
                potential = following
                row[episode] += 1
    assert first[0] < steps[:, 0].mean() < first[1]
    assert early[0] < steps.mean() < early[1]


@pytest.mark.slow
def test_the_best_car_needs_98_steps() -> None:
    """On average over starts: so dynamic programming has it."""
    starts = np.linspace(-0.6, -0.4, 201)
    steps = -interpolate(optimal_values(), starts, np.zeros_like(starts))
    assert steps.mean() == pytest.approx(97.7, abs=2.0)
