"""Temporal-difference learning with tables, equations 2.11 to 2.14, and linearly, 2.23.

Tables are V (states,) and Q (states, actions), updated in place. Each update returns its TD error.
The value of a terminal state is 0, whatever its entry in the table is.
"""

import numpy as np

from crcolony.compiled import FloatArray, IntArray, compiled
from crcolony.learning.policies import greedy


@compiled
def td_error(reward: float, gamma: float, value_next: float, value: float) -> float:
    """Return delta_t = r_(t+1) + gamma V(s_(t+1)) - V(s_t) (eq. 2.11)."""
    return reward + gamma * value_next - value


@compiled
def td0(
    v: FloatArray,
    state: int,
    reward: float,
    state_next: int,
    terminal: bool,
    alpha: float,
    gamma: float,
) -> float:
    """Update V by TD(0) (eq. 2.12)."""
    value_next = 0.0 if terminal else v[state_next]
    delta = td_error(reward, gamma, value_next, v[state])
    v[state] += alpha * delta
    return delta


@compiled
def sarsa0(
    q: FloatArray,
    state: int,
    action: int,
    reward: float,
    state_next: int,
    action_next: int,
    terminal: bool,
    alpha: float,
    gamma: float,
) -> float:
    """Update Q by Sarsa(0) (eq. 2.13): on-policy, by the value of the action that is taken next."""
    value_next = 0.0 if terminal else q[state_next, action_next]
    delta = td_error(reward, gamma, value_next, q[state, action])
    q[state, action] += alpha * delta
    return delta


@compiled
def q_learning(
    q: FloatArray,
    state: int,
    action: int,
    reward: float,
    state_next: int,
    terminal: bool,
    alpha: float,
    gamma: float,
) -> float:
    """Update Q by one-step Q-learning (eq. 2.14): off-policy, by the value of the best action."""
    value_next = 0.0 if terminal else q[state_next, greedy(q[state_next], 0.0)]
    delta = td_error(reward, gamma, value_next, q[state, action])
    q[state, action] += alpha * delta
    return delta


def linear_values(theta: FloatArray, indices: IntArray, values: FloatArray) -> FloatArray:
    """Return Q_s (actions,) of a state: linear in `theta` (n, actions) (eq. 2.23).

    `indices` and `values` are the features of the state, as a `FeatureMap` returns them.
    """
    return np.asarray(values @ theta[indices], dtype=np.float64)
