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


EPISODES, STEPS, STATE, ACTION = range(4)
"""Elements of `Episodes.counts`"""


class Episodes(NamedTuple):
    """The episodes that have ended, the first of room for more, and the one that goes on."""

    counts: IntArray
    """(4,) how many have ended, steps of all, and the present STATE and ACTION, which is NO_ACTION between episodes"""
    total: FloatArray
    """(1,) what the present one has earned"""
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
    counts = np.array([0, 0, 0, NO_ACTION])
    return Episodes(counts, np.zeros(1), np.zeros(room, dtype=np.int64), np.zeros(room))


@compiled
def learn_by_maxq(
    learner: Learner,
    starts: IntArray,
    step_cost_in_addition: bool,
    steps: int,
    stream: Stream,
    episodes: Episodes,
) -> None:
    """Learn for a number of steps, and go on in the same episode when called again."""
    state, action = episodes.counts[STATE], episodes.counts[ACTION]
    for _ in range(steps):
        if action == NO_ACTION:
            state = draw_start(starts, stream)
            action = start_episode(learner, state, stream)
        state, reward, terminal = step(state, action, step_cost_in_addition)
        action = learn_and_select(learner, reward, state, terminal, stream)
        _count(episodes, reward, action == NO_ACTION)
    episodes.counts[STATE], episodes.counts[ACTION] = state, action


@compiled
def learn_by_q_learning(
    learner: FlatLearner,
    starts: IntArray,
    step_cost_in_addition: bool,
    steps: int,
    stream: Stream,
    episodes: Episodes,
) -> None:
    """Learn for a number of steps, and go on in the same episode when called again."""
    q, parameters, scratch = learner
    state, action = episodes.counts[STATE], episodes.counts[ACTION]
    for _ in range(steps):
        if action == NO_ACTION:
            state = draw_start(starts, stream)
        action = softmax(q[state], parameters[2], scratch, draw(stream))
        state_next, reward, terminal = step(state, action, step_cost_in_addition)
        q_learning(q, state, action, reward, state_next, terminal, parameters[0], parameters[1])
        state = state_next
        if terminal:
            action = NO_ACTION
            parameters[2] *= parameters[3]
        _count(episodes, reward, terminal)
    episodes.counts[STATE], episodes.counts[ACTION] = state, action


@compiled
def _count(episodes: Episodes, reward: float, is_over: bool) -> None:
    """Count a step, and the episode if it is over."""
    episodes.counts[STEPS] += 1
    episodes.total[0] += reward
    if is_over:
        place = episodes.counts[EPISODES]
        if place < episodes.ends.shape[0]:
            episodes.ends[place] = episodes.counts[STEPS]
            episodes.returns[place] = episodes.total[0]
            episodes.counts[EPISODES] += 1
        episodes.total[0] = 0.0


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
