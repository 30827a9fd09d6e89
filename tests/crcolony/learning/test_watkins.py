"""Watkins's Q(lambda) follows Algorithm 2.1."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crcolony.learning.features import NormalizedRBF, TileCoding
from crcolony.learning.td import q_learning
from crcolony.learning.watkins import WatkinsQLambda

fractions = st.floats(0.0, 1.0)


def corridor(states: int) -> TileCoding:
    """Return one tile for each of the states 0, 1, ... `states` - 1: a table."""
    return TileCoding(np.zeros(1), np.array([float(states)]), np.array([states]), np.zeros((1, 1)))


@given(st.integers(0, 2**32), fractions, fractions)
def test_without_lambda_it_is_one_step_q_learning(seed: int, alpha: float, gamma: float) -> None:
    """With lambda 0 and a tile for each state, it makes the updates of equation 2.14."""
    rng = np.random.default_rng(seed)
    learner = WatkinsQLambda(corridor(5), 3, alpha, gamma, 0.0, temperature=1.0)
    q = np.zeros((6, 3))
    state = 0
    action = learner.start(np.array([0.5]), float(rng.random()))
    for t in range(40):
        # never the last state: Algorithm 2.1 keeps Q_s from before the update
        state_next = (state + int(rng.integers(1, 5))) % 5
        reward, terminal = float(rng.normal()), t == 39
        chosen = learner.step(reward, np.array([state_next + 0.5]), terminal, float(rng.random()))
        q_learning(q, state, action, reward, state_next, terminal, alpha, gamma)
        state, action = state_next, chosen
    np.testing.assert_allclose(learner.theta, q, atol=1e-10)


def test_an_exploratory_action_clears_all_traces() -> None:
    """After a greedy action traces fade by gamma lambda, after another one only the newest is
    left."""
    learner = WatkinsQLambda(corridor(3), 2, 0.0, 1.0, 0.5, temperature=1e9)
    learner.theta[:, 1] = 1.0
    learner.start(np.array([0.5]), 0.9)
    learner.step(0.0, np.array([1.5]), False, 0.9)
    assert learner.e[:3].tolist() == [[0.0, 0.5], [0.0, 1.0], [0.0, 0.0]]
    learner.step(0.0, np.array([2.5]), False, 0.1)
    assert learner.e[:3].tolist() == [[0.0, 0.0], [0.0, 0.0], [1.0, 0.0]]


def test_ties_count_as_greedy() -> None:
    """Where all actions have the same value, none of them is exploratory."""
    learner = WatkinsQLambda(corridor(2), 2, 0.0, 1.0, 0.5)
    for first, second in [(0.1, 0.9), (0.9, 0.1)]:
        learner.start(np.array([0.5]), first)
        learner.step(0.0, np.array([1.5]), False, second)
        assert np.sort(learner.e.ravel())[-2:].tolist() == [0.5, 1.0]


def test_traces_carry_a_reward_back_along_the_path() -> None:
    """One episode with lambda 1 and alpha 1 gives every state of the path its discounted return."""
    learner = WatkinsQLambda(corridor(4), 1, 1.0, 0.5, 1.0)
    learner.start(np.array([0.5]), 0.0)
    for state in range(1, 4):
        assert learner.step(0.0, np.array([state + 0.5]), False, 0.0) == 0
    assert learner.step(8.0, np.array([4.0]), True, 0.0) == -1
    assert learner.theta[:4, 0].tolist() == [1.0, 2.0, 4.0, 8.0]
    assert not learner.e.any()


def test_it_learns_with_an_rbf_network() -> None:
    """In a continuous corridor the learnt value of going right is above that of going left
    everywhere."""
    rng = np.random.default_rng(5)
    network = NormalizedRBF.grid(np.zeros(1), np.ones(1), np.array([6]))
    learner = WatkinsQLambda(network, 2, 0.1, 0.9, 0.8, temperature=0.1)
    for _ in range(300):
        x, terminal = float(rng.random()), False
        action = learner.start(np.array([x]), float(rng.random()))
        while not terminal:
            x = max(x + (0.1 if action == 1 else -0.1), 0.0)
            terminal = x >= 1.0
            action = learner.step(float(terminal), np.array([x]), terminal, float(rng.random()))
    for x in (0.1, 0.3, 0.5, 0.7, 0.9):
        left, right = learner.values(np.array([x]))
        assert right > left
    assert learner.values(np.array([0.95]))[1] == pytest.approx(1.0, abs=0.15)


def test_an_impossible_learner_is_refused() -> None:
    """Meta-parameters out of range and no actions raise ValueError."""
    for actions, alpha, gamma, lambda_, temperature in [
        (0, 0.1, 0.9, 0.9, 0.0),
        (2, -0.1, 0.9, 0.9, 0.0),
        (2, 0.1, 1.1, 0.9, 0.0),
        (2, 0.1, 0.9, 1.1, 0.0),
        (2, 0.1, 0.9, 0.9, -1.0),
    ]:
        with pytest.raises(ValueError):
            WatkinsQLambda(corridor(2), actions, alpha, gamma, lambda_, temperature)
