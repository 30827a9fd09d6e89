"""TD(0), Sarsa(0) and Q-learning converge to the values that are known in closed form."""

import numpy as np
import pytest

from crcolony.compiled import FloatArray
from crcolony.learning.td import linear_values, q_learning, sarsa0, td0, td_error


def walk(states: int, reward_left: float, rng: np.random.Generator) -> FloatArray:
    """Return the values of a random walk by TD(0): the reward is 1 for leaving right, else
    `reward_left`.

    The learning rate falls with the visits of a state.
    """
    v = np.zeros(states)
    visits = np.zeros(states)
    for _ in range(3000):
        state = states // 2
        terminal = False
        while not terminal:
            state_next = state + (1 if rng.random() < 0.5 else -1)
            terminal = not 0 <= state_next < states
            reward = 0.0 if not terminal else 1.0 if state_next == states else reward_left
            visits[state] += 1
            alpha = 1.0 / (1.0 + 0.1 * visits[state]) ** 0.8
            td0(v, state, reward, state_next, terminal, alpha, 1.0)
            state = state_next
    return v


@pytest.mark.parametrize(("states", "reward_left", "tolerance"), [(5, 0.0, 0.03), (19, -1.0, 0.08)])
def test_td0_converges_to_the_values_of_random_walks(
    states: int, reward_left: float, tolerance: float
) -> None:
    """The value of a state is the mean of both ends, weighted by its distance from them."""
    to_the_right = np.arange(1, states + 1) / (states + 1)
    expected = to_the_right + (1.0 - to_the_right) * reward_left
    v = walk(states, reward_left, np.random.default_rng(1))
    assert np.sqrt(np.mean((v - expected) ** 2)) < tolerance


def test_the_true_values_have_no_expected_td_error() -> None:
    """At the closed-form values the errors of going left and right cancel in every state."""
    v = np.arange(7) / 6.0
    for state in range(1, 6):
        left = td_error(0.0, 1.0, v[state - 1], v[state])
        right = td_error(0.0, 1.0, v[state + 1], v[state])
        assert left + right == pytest.approx(0.0, abs=1e-15)


def test_one_update_by_hand() -> None:
    """Sarsa(0) uses the value of the action taken, Q-learning that of the best, and 0 for a
    terminal state."""
    q = np.array([[1.0, 2.0], [3.0, 5.0]])
    assert sarsa0(q, 0, 1, 0.5, 1, 0, False, 0.1, 0.9) == pytest.approx(0.5 + 2.7 - 2.0)
    assert q[0, 1] == pytest.approx(2.12)
    assert q_learning(q, 0, 0, 0.5, 1, False, 0.1, 0.9) == pytest.approx(0.5 + 4.5 - 1.0)
    assert q[0, 0] == pytest.approx(1.4)
    assert q_learning(q, 1, 0, 1.0, 1, True, 0.5, 0.9) == pytest.approx(-2.0)
    assert sarsa0(q, 1, 1, 1.0, 1, 1, True, 0.5, 0.9) == pytest.approx(-4.0)
    assert q[1].tolist() == [2.0, 3.0]


def test_q_learning_converges_to_the_optimum_with_random_actions() -> None:
    """In a corridor with a reward of 1 at its end, Q* is gamma to the power of the distance."""
    rng = np.random.default_rng(2)
    states, gamma = 6, 0.9
    q = np.zeros((states, 2))
    for _ in range(20_000):
        state, action = int(rng.integers(states)), int(rng.integers(2))
        state_next = max(state + (1 if action else -1), 0)
        terminal = state_next == states
        q_learning(
            q, state, action, float(terminal), min(state_next, states - 1), terminal, 0.5, gamma
        )
    best = gamma ** np.arange(states - 1, -1, -1)
    np.testing.assert_allclose(q[:, 1], best, rtol=1e-6)
    np.testing.assert_allclose(q[1:, 0], gamma * best[:-1], rtol=1e-6)


def test_linear_values_are_sums_over_the_features() -> None:
    """Q_s is the sum of the rows of Theta, weighted by the features that are not zero."""
    theta = np.arange(8.0).reshape(4, 2)
    values = linear_values(theta, np.array([1, 3]), np.array([0.5, 2.0]))
    assert values.tolist() == [0.5 * 2 + 2 * 6, 0.5 * 3 + 2 * 7]
