"""The best that a taxi can do, by dynamic programming, and what a table of action values does."""

import numpy as np

from crcolony.compiled import BoolArray, FloatArray, IntArray, compiled
from crcolony.experiments.worlds.taxi import (
    ACTIONS,
    LONGEST_TRIP,
    STATES,
    RewardConvention,
    step,
)


def drive_by_table(q: FloatArray, starts: IntArray, convention: RewardConvention) -> FloatArray:
    """Return what the greedy actions of a table q (states, actions) earn from each of `starts`."""
    state_next, rewards, ends = transitions(convention)
    best = q.argmax(axis=1)
    state, goes_on = starts.copy(), np.ones(starts.size, dtype=np.bool_)
    returns = np.zeros(starts.size)
    for _ in range(LONGEST_TRIP):
        action = best[state]
        returns += goes_on * rewards[state, action]
        goes_on &= ~ends[state, action]
        state = state_next[state, action]
    return returns


@compiled
def _fill_transitions(
    step_cost_in_addition: bool, state_next: IntArray, rewards: FloatArray, ends: BoolArray
) -> None:
    for state in range(STATES):
        for action in range(ACTIONS):
            found, reward, is_over = step(state, action, step_cost_in_addition)
            state_next[state, action], rewards[state, action] = found, reward
            ends[state, action] = is_over


def transitions(convention: RewardConvention) -> tuple[IntArray, FloatArray, BoolArray]:
    """Return next states, rewards and whether the episode ends, of all states and actions (states, actions)."""
    state_next = np.zeros((STATES, ACTIONS), dtype=np.int64)
    rewards = np.zeros((STATES, ACTIONS))
    ends = np.zeros((STATES, ACTIONS), dtype=np.bool_)
    _fill_transitions(convention.is_in_addition, state_next, rewards, ends)
    return state_next, rewards, ends


def optimal_values(convention: RewardConvention) -> FloatArray:
    """Return V* (states,) without discounting, by value iteration (section 2.2): exact after finitely many sweeps."""
    state_next, rewards, ends = transitions(convention)
    values = np.zeros(STATES)
    while True:
        found = np.where(ends, rewards, rewards + values[state_next]).max(axis=1)
        if np.array_equal(found, values):
            return values
        values = found
