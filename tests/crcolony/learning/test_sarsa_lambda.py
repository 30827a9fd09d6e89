"""The lazy Sarsa(lambda) is Algorithm 2.2, step by step."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crcolony.learning.features import TileCoding, uniform_offsets
from crcolony.learning.sarsa_learner import SarsaLambda
from crcolony.learning.td import sarsa0
from tests.support.oracles.dense_sarsa_lambda import DenseSarsaLambda

LOW, HIGH = np.array([0.0, -1.0]), np.array([2.0, 1.0])
ACTIONS = 3

seeds = st.integers(0, 2**32)
fractions = st.floats(0.0, 1.0) | st.sampled_from([0.0, 1.0])


def corridor(states: int) -> TileCoding:
    """Return one tile for each of the states 0, 1, ... `states` - 1: a table."""
    return TileCoding(np.zeros(1), np.array([float(states)]), np.array([states]), np.zeros((1, 1)))


@given(seeds, fractions, fractions, fractions, st.floats(0.1, 5.0), st.integers(1, 6))
def test_it_equals_the_algorithm_as_printed(
    seed: int, alpha: float, gamma: float, lambda_: float, temperature: float, tilings: int
) -> None:
    """The same draws give the same actions, and the same weights after every episode, to 1e-8."""
    rng = np.random.default_rng(seed)
    coding = TileCoding(LOW, HIGH, np.array([3, 4]), uniform_offsets(tilings, 2))
    fast = SarsaLambda(coding, ACTIONS, alpha, gamma, lambda_, temperature)
    dense = DenseSarsaLambda(coding, ACTIONS, alpha, gamma, lambda_, temperature)
    for _ in range(3):
        state, u = rng.uniform(LOW, HIGH), float(rng.random())
        assert fast.start(state, u) == dense.start(state, u)
        for t in range(60):
            state, u, reward = rng.uniform(LOW, HIGH), float(rng.random()), float(rng.normal())
            chosen = fast.step(reward, state, t == 59, u)
            assert chosen == dense.step(reward, state, t == 59, u)
        np.testing.assert_allclose(fast.weights(), dense.weights, atol=1e-8)


@given(seeds, fractions, fractions)
def test_without_lambda_it_is_one_step_sarsa(seed: int, alpha: float, gamma: float) -> None:
    """With lambda 0 and a tile for each state, it makes the updates of equation 2.13."""
    rng = np.random.default_rng(seed)
    learner = SarsaLambda(corridor(5), ACTIONS, alpha, gamma, 0.0, temperature=1.0)
    q = np.zeros((6, ACTIONS))
    state = int(rng.integers(5))
    action = learner.start(np.array([state + 0.5]), float(rng.random()))
    for t in range(50):
        state_next, reward, terminal = int(rng.integers(5)), float(rng.normal()), t == 49
        action_next = learner.step(
            reward, np.array([state_next + 0.5]), terminal, float(rng.random())
        )
        sarsa0(q, state, action, reward, state_next, action_next, terminal, alpha, gamma)
        state, action = state_next, action_next
    np.testing.assert_allclose(learner.weights(), q, atol=1e-10)


@given(seeds, fractions, fractions)
def test_with_lambda_one_it_is_monte_carlo(seed: int, alpha: float, gamma: float) -> None:
    """On an episode without revisits each value moves by alpha towards its discounted return."""
    rng = np.random.default_rng(seed)
    rewards = rng.normal(size=8)
    learner = SarsaLambda(corridor(8), 1, alpha, gamma, 1.0)
    learner.start(np.array([0.5]), 0.0)
    for state, reward in enumerate(rewards):
        learner.step(float(reward), np.array([state + 1.5]), state == 7, 0.0)
    value = 0.0
    for state in range(7, -1, -1):
        value = rewards[state] + gamma * value
        assert learner.weights()[state, 0] == pytest.approx(alpha * value, abs=1e-9)


def test_the_value_of_a_terminal_state_is_zero() -> None:
    """The last update of an episode depends on its reward only, whatever the terminal tile
    holds."""
    learner = SarsaLambda(corridor(2), 1, 1.0, 1.0, 1.0)
    learner.learner.weights[1] = 100.0
    learner.start(np.array([0.5]), 0.0)
    assert learner.step(3.0, np.array([1.5]), True, 0.0) == -1
    assert learner.weights()[:2, 0].tolist() == [3.0, 100.0]


def test_an_episode_does_not_update_the_states_of_another() -> None:
    """Its reward changes no state that only an earlier, interrupted episode has visited."""
    learner = SarsaLambda(corridor(3), 1, 0.5, 1.0, 1.0)
    learner.start(np.array([0.5]), 0.0)
    learner.step(0.0, np.array([1.5]), False, 0.0)
    learner.start(np.array([2.5]), 0.0)
    learner.step(8.0, np.array([2.5]), True, 0.0)
    assert learner.weights()[:3, 0].tolist() == [0.0, 0.0, 4.0]


def test_optimistic_initial_values_explore_without_a_random_policy() -> None:
    """A greedy learner tries every action of a state if all values start above the rewards."""
    coding = corridor(1)
    rewards = [0.1, 0.9, 0.5]
    tried = {}
    for initial_value in (0.0, 2.0):
        learner = SarsaLambda(coding, 3, 0.5, 0.0, 0.0, initial_value=initial_value)
        assert learner.action_values(np.zeros(1)).tolist() == [initial_value] * 3
        action = learner.start(np.zeros(1), 0.0)
        actions = []
        for _ in range(30):
            actions.append(action)
            action = learner.step(rewards[action], np.zeros(1), False, 0.0)
        tried[initial_value] = actions
    assert set(tried[0.0]) == {0}
    assert set(tried[2.0]) == {0, 1, 2}
    assert set(tried[2.0][-10:]) == {1}


def test_after_a_terminal_state_no_update_is_pending() -> None:
    """The arrays of the learner hold the final weights as soon as an episode is over."""
    learner = SarsaLambda(corridor(3), 1, 1.0, 1.0, 1.0)
    learner.start(np.array([0.5]), 0.0)
    learner.step(0.0, np.array([1.5]), False, 0.0)
    learner.step(5.0, np.array([2.5]), True, 0.0)
    assert learner.learner.weights[:3, 0].tolist() == [5.0, 5.0, 0.0]
