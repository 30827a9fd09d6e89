"""Learners drive the taxi, in compiled loops: MAXQ-Q, and flat Q-learning."""

from typing import NamedTuple

import numpy as np

from crcolony.compiled import FloatArray, IntArray, compiled
from crcolony.experiments.worlds.taxi import (
    ACTIONS,
    LONGEST_TRIP,
    STATES,
    draw_start,
    step,
)
from crcolony.learning.maxq.decomposition import Tables, greedy_action
from crcolony.learning.maxq.flat_graph import FlatGraph
from crcolony.learning.maxq.maxq_q import Learner, learn_and_select, start_episode
from crcolony.learning.policies import NO_ACTION, softmax
from crcolony.learning.td import q_learning
from crcolony.randomness import Stream, draw


class FlatLearner(NamedTuple):
    """Q-learning with a table, its temperature cooled after every episode."""

    q: FloatArray
    """(states, actions)"""
    parameters: FloatArray
    """(4,) alpha, gamma, temperature, cooling"""
    scratch: FloatArray
    """(actions,)"""


class Episodes(NamedTuple):
    """The episodes that have ended, the first `counts[0]` of room for more."""

    counts: IntArray
    """(2,) episodes, steps"""
    ends: IntArray
    """(room,) the step, of all, with which each ended"""
    returns: FloatArray
    """(room,)"""


def flat_learner(
    alpha: float, gamma: float, temperature: float, cooling: float, initial_value: float
) -> FlatLearner:
    """Return a learner that knows nothing."""
    q = np.full((STATES, ACTIONS), initial_value)
    return FlatLearner(q, np.array([alpha, gamma, temperature, cooling]), np.zeros(ACTIONS))


def no_episodes(room: int) -> Episodes:
    """Return an empty list of episodes."""
    return Episodes(np.zeros(2, dtype=np.int64), np.zeros(room, dtype=np.int64), np.zeros(room))


@compiled
def learn_by_maxq(
    learner: Learner,
    starts: IntArray,
    step_cost_in_addition: bool,
    steps: int,
    stream: Stream,
    episodes: Episodes,
) -> None:
    """Learn for a number of steps; an episode that is not over at the end is left."""
    state, action, total = 0, NO_ACTION, 0.0
    for _ in range(steps):
        if action == NO_ACTION:
            state, total = draw_start(starts, stream), 0.0
            action = start_episode(learner, state, stream)
        state, reward, terminal = step(state, action, step_cost_in_addition)
        total += reward
        action = learn_and_select(learner, reward, state, terminal, stream)
        _count(episodes, action == NO_ACTION, total)


@compiled
def learn_by_q_learning(
    learner: FlatLearner,
    starts: IntArray,
    step_cost_in_addition: bool,
    steps: int,
    stream: Stream,
    episodes: Episodes,
) -> None:
    """Learn for a number of steps; an episode that is not over at the end is left."""
    q, parameters, scratch = learner
    state, is_over, total = 0, True, 0.0
    for _ in range(steps):
        if is_over:
            state, total = draw_start(starts, stream), 0.0
        action = softmax(q[state], parameters[2], scratch, draw(stream))
        state_next, reward, is_over = step(state, action, step_cost_in_addition)
        q_learning(q, state, action, reward, state_next, is_over, parameters[0], parameters[1])
        if is_over:
            parameters[2] *= parameters[3]
        state = state_next
        total += reward
        _count(episodes, is_over, total)


@compiled
def _count(episodes: Episodes, is_over: bool, total: float) -> None:
    episodes.counts[1] += 1
    if is_over and episodes.counts[0] < episodes.ends.shape[0]:
        episodes.ends[episodes.counts[0]] = episodes.counts[1]
        episodes.returns[episodes.counts[0]] = total
        episodes.counts[0] += 1


@compiled
def drive_greedily(
    graph: FlatGraph,
    tables: Tables,
    starts: IntArray,
    step_cost_in_addition: bool,
    returns: FloatArray,
) -> None:
    """Write to `returns` (starts,) what the greedy action of the hierarchy earns from each start, in every step."""
    for number in range(starts.shape[0]):
        state = starts[number]
        returns[number] = 0.0
        for _ in range(LONGEST_TRIP):
            action = greedy_action(graph, tables, state)
            state, reward, is_over = step(state, action, step_cost_in_addition)
            returns[number] += reward
            if is_over:
                break
