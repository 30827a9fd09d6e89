"""The mountain car is that of Gymnasium, and of Sutton and Barto."""

import numpy as np
import pytest
from gymnasium.envs.classic_control.mountain_car import MountainCarEnv

from crcolony.experiments.worlds.mountain_car import draw_start, drive, random_starts
from crcolony.randomness import new_streams


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
