"""Sarsa(lambda) with tile coding and replacing traces with the optional clearing, Algorithm 2.2.

`update_weights` is the update of the algorithm, `start_episode` and `learn_and_select` are its loop
over the arrays of one `Learner`. A compiled loop calls these two; anything else, such as a loop
over a Gymnasium environment, uses `sarsa_learner.SarsaLambda` with one call a step. The robot's
control step (`robot/step.py`) makes the same calls in the same order, with several learning modules
that take turns. What the algorithm is printed without: after a step, s <- s', a <- a', I_s <- I_s';
and the value of a terminal state is 0.
"""

from typing import NamedTuple

from crcolony.compiled import AnyFloatArray, FloatArray, IntArray, as_index, compiled
from crcolony.learning.features import tile_indices
from crcolony.learning.policies import NO_ACTION, softmax
from crcolony.learning.traces import (
    accumulate_error,
    action_values,
    clear_traces,
    set_traces,
)

RATE = 0
"""Element of `meta_parameters`: alpha / N."""
GAMMA = 1
"""Element of `meta_parameters`: gamma."""
GAMMA_LAMBDA = 2
"""Element of `meta_parameters`: gamma lambda."""
TEMPERATURE = 3
"""Element of `meta_parameters`: tau."""


class Learner(NamedTuple):
    """All arrays of one learner: n tiles in N tilings over d dimensions."""

    weights: FloatArray
    """(n, actions) Theta"""
    traces: FloatArray
    """(n, 4) see `traces.py`"""
    totals: FloatArray
    """(3,) see `traces.py`"""
    meta_parameters: FloatArray
    """(4,) RATE, GAMMA, GAMMA_LAMBDA, TEMPERATURE"""
    values: FloatArray
    """(actions,) Q_s"""
    scratch: FloatArray
    """(actions,)"""
    low: FloatArray
    """(d,) lower corner of the box that the tilings cover"""
    tiles_per_unit: FloatArray
    """(d,) tiles along a unit of each axis"""
    offsets: FloatArray
    """(N, d) displacement of every tiling, in tiles"""
    traced_tiles: IntArray
    """(n,) see `traces.py`"""
    active_tiles: IntArray
    """(N,) I_s of the state in which the last action was selected"""
    next_tiles: IntArray
    """(N,) I_s of the state after it"""
    tile_counts: IntArray
    """(d,) tiles along each axis"""


@compiled
def update_weights(
    weights: AnyFloatArray,
    totals: FloatArray,
    rows: IntArray,
    action: int,
    reward: float,
    gamma: float,
    value_next: float,
) -> None:
    """delta <- r + gamma Q(s', a') - Q(s, a); Theta <- Theta + alpha / N delta e (eq. 2.25, 2.15).

    `rows` (N,) of weights and `action` are those of the last `set_traces`, and `value_next` is Q(s', a'). The
    update of the weights stays pending until their tiles are active again (see `traces.py`).
    """
    delta = reward + gamma * value_next
    for position in range(rows.shape[0]):  # their traces were just set: no update is pending
        delta -= weights[as_index(rows[position]), action]
    accumulate_error(totals, delta)


@compiled
def start_episode(learner: Learner, state: FloatArray, u: float) -> int:
    """Start an episode in `state` (d,) with the uniform draw `u`; return the first action."""
    clear(learner)
    action = _select_action(learner, state, u)
    _set_traces(learner, action)
    return action


@compiled
def learn_and_select(
    learner: Learner, action: int, reward: float, state: FloatArray, terminal: bool, u: float
) -> int:
    """Learn from the `reward` and next `state` (d,) that `action` led to; return the next action.

    `action` is what the last `start_episode` or `learn_and_select` returned, `u` is a uniform draw.
    After a terminal state the next action is NO_ACTION.
    """
    action_next, value_next = NO_ACTION, 0.0
    if not terminal:
        action_next = _select_action(learner, state, u)
        value_next = learner.values[action_next]
    update_weights(
        learner.weights,
        learner.totals,
        learner.active_tiles,
        action,
        reward,
        learner.meta_parameters[GAMMA],
        value_next,
    )
    if terminal:
        clear(learner)
    else:
        _set_traces(learner, action_next)
    return action_next


@compiled
def _select_action(learner: Learner, state: FloatArray, u: float) -> int:
    """Write I_s and Q_s of `state` (d,), and select an action by softmax (eq. 2.18)."""
    tile_indices(
        state,
        learner.low,
        learner.tiles_per_unit,
        learner.tile_counts,
        learner.offsets,
        learner.next_tiles,
    )
    action_values(
        learner.weights,
        learner.traces,
        learner.totals,
        learner.next_tiles,
        learner.next_tiles,
        learner.meta_parameters[RATE],
        learner.values,
    )
    return softmax(learner.values, learner.meta_parameters[TEMPERATURE], learner.scratch, u)


@compiled
def _set_traces(learner: Learner, action: int) -> None:
    """Fade the traces, set those of `action` in the next state, and make that the present state."""
    set_traces(
        learner.weights,
        learner.traces,
        learner.traced_tiles,
        learner.totals,
        learner.next_tiles,
        learner.next_tiles,
        action,
        learner.meta_parameters[GAMMA_LAMBDA],
        learner.meta_parameters[RATE],
    )
    for position in range(learner.active_tiles.shape[0]):
        learner.active_tiles[position] = learner.next_tiles[position]


@compiled
def clear(learner: Learner) -> None:
    """e <- 0, after all pending updates have been applied."""
    clear_traces(
        learner.weights,
        learner.traces,
        learner.traced_tiles,
        learner.totals,
        learner.meta_parameters[RATE],
    )
