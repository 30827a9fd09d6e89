"""Sarsa(lambda) with tile coding and replacing traces with the optional clearing, Algorithm 2.2.

`update_weights` is the update of the algorithm, `start_episode` and `learn_and_select` are its loop
over the arrays of one `Learner`. A compiled loop calls these two; anything else, such as a loop
over a Gymnasium environment, uses a `SarsaLambda` with one call a step. The robot's control step
(`robot/step.py`) makes the same calls in the same order, with several learning modules that take
turns. What the algorithm is printed without: after a step, s <- s', a <- a', I_s <- I_s'; and the
value of a terminal state is 0.
"""

from functools import partial
from typing import NamedTuple

import numpy as np

from crcolony.compiled import FloatArray, IntArray, compiled
from crcolony.learning.features import TileCoding, tile_indices
from crcolony.learning.policies import NO_ACTION, softmax
from crcolony.learning.traces import (
    accumulate_error,
    action_values,
    clear_traces,
    renormalise,
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
_SIZES = 4
"""The block of integers begins with so many sizes."""
_LAST_ACTION = _SIZES
"""Place of the last action in the block of integers."""


class Learner(NamedTuple):
    """All arrays of one learner: n tiles in N tilings over d dimensions."""

    weights: FloatArray
    """(n, actions) Theta"""
    traces: FloatArray
    """(n, 3) see `traces.py`"""
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
    high: FloatArray
    """(d,) upper corner"""
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
    weights: FloatArray,
    totals: FloatArray,
    tiles: IntArray,
    action: int,
    reward: float,
    gamma: float,
    value_next: float,
) -> None:
    """delta <- r + gamma Q(s', a') - Q(s, a); Theta <- Theta + alpha / N delta e (eq. 2.25, 2.15).

    `tiles` (N,) and `action` are those of the last `set_traces`, and `value_next` is Q(s', a'). The
    update of the weights stays pending until their tiles are active again (see `traces.py`).
    """
    delta = reward + gamma * value_next
    for position in range(tiles.shape[0]):  # their traces were just set: no update is pending
        delta -= weights[tiles[position], action]
    accumulate_error(totals, delta)


@compiled
def start_episode(learner: Learner, state: FloatArray, u: float) -> int:
    """Start an episode in `state` (d,) with the uniform draw `u`; return the first action."""
    _clear(learner)
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
    gamma = learner.meta_parameters[GAMMA]
    if terminal:
        update_weights(
            learner.weights, learner.totals, learner.active_tiles, action, reward, gamma, 0.0
        )
        _clear(learner)
        return NO_ACTION
    action_next = _select_action(learner, state, u)
    update_weights(
        learner.weights,
        learner.totals,
        learner.active_tiles,
        action,
        reward,
        gamma,
        learner.values[action_next],
    )
    _set_traces(learner, action_next)
    return action_next


@compiled
def _select_action(learner: Learner, state: FloatArray, u: float) -> int:
    """Write I_s and Q_s of `state` (d,), and select an action by softmax (eq. 2.18)."""
    tile_indices(
        state,
        learner.low,
        learner.high,
        learner.tile_counts,
        learner.offsets,
        learner.next_tiles,
    )
    action_values(
        learner.weights,
        learner.traces,
        learner.totals,
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
        action,
        learner.meta_parameters[GAMMA_LAMBDA],
        learner.meta_parameters[RATE],
    )
    for position in range(learner.active_tiles.shape[0]):
        learner.active_tiles[position] = learner.next_tiles[position]


@compiled
def _clear(learner: Learner) -> None:
    """e <- 0, after all pending updates have been applied."""
    clear_traces(
        learner.weights,
        learner.traces,
        learner.traced_tiles,
        learner.totals,
        learner.meta_parameters[RATE],
    )


def unpack(floats: FloatArray, integers: IntArray) -> Learner:
    """Return the arrays of a learner, as views of the two blocks that a `SarsaLambda` keeps them
    in."""
    size, actions, tilings, dimensions = integers[0], integers[1], integers[2], integers[3]
    traces = size * actions
    totals = traces + size * 3
    meta_parameters = totals + 3
    values = meta_parameters + 4
    scratch = values + actions
    low = scratch + actions
    high = low + dimensions
    offsets = high + dimensions
    traced_tiles = _LAST_ACTION + 1
    active_tiles = traced_tiles + size
    next_tiles = active_tiles + tilings
    tile_counts = next_tiles + tilings
    return Learner(
        floats[:traces].reshape((size, actions)),
        floats[traces:totals].reshape((size, 3)),
        floats[totals:meta_parameters],
        floats[meta_parameters:values],
        floats[values:scratch],
        floats[scratch:low],
        floats[low:high],
        floats[high:offsets],
        floats[offsets:].reshape((tilings, dimensions)),
        integers[traced_tiles:active_tiles],
        integers[active_tiles:next_tiles],
        integers[next_tiles:tile_counts],
        integers[tile_counts:],
    )


_unpack = compiled(unpack)


@compiled
def _start_packed(floats: FloatArray, integers: IntArray, state: FloatArray, u: float) -> int:
    """`start_episode` for a caller in Python, for whom passing an array costs as much as a
    step."""
    action = start_episode(_unpack(floats, integers), state, u)
    integers[_LAST_ACTION] = action
    return action


@compiled
def _learn_packed(
    floats: FloatArray,
    integers: IntArray,
    reward: float,
    state: FloatArray,
    terminal: bool,
    u: float,
) -> int:
    """`learn_and_select` after the last action, for a caller in Python."""
    action = learn_and_select(
        _unpack(floats, integers), integers[_LAST_ACTION], reward, state, terminal, u
    )
    integers[_LAST_ACTION] = action
    return action


class SarsaLambda:
    """A learner to call once a step: `start`, then `step` until a terminal state.

    Weights start so that every action is worth `initial_value`: optimistic ones make a greedy
    learner explore (section 2.6). States are float64 (d,); `u` are uniform draws in [0, 1).
    """

    def __init__(
        self,
        coding: TileCoding,
        actions: int,
        alpha: float,
        gamma: float,
        lambda_: float,
        temperature: float = 0.0,
        initial_value: float = 0.0,
    ) -> None:
        """Raises ValueError for no action, or a meta-parameter out of its range."""
        if actions < 1:
            raise ValueError(f"a learner needs an action, got {actions}")
        if not (0.0 <= gamma <= 1.0 and 0.0 <= lambda_ <= 1.0):
            raise ValueError(f"gamma and lambda are in [0, 1], got {gamma} and {lambda_}")
        if not (alpha >= 0.0 and temperature >= 0.0):
            raise ValueError(f"not negative: alpha {alpha} and temperature {temperature}")
        tilings, dimensions = coding.offsets.shape
        floats = np.zeros(
            coding.size * (actions + 3) + 3 + 4 + 2 * actions + dimensions * (2 + tilings)
        )
        integers = np.zeros(_SIZES + 1 + coding.size + 2 * tilings + dimensions, dtype=np.int64)
        integers[:_SIZES] = coding.size, actions, tilings, dimensions
        self.learner = unpack(floats, integers)
        self.learner.weights[:] = initial_value / tilings
        self.learner.totals[:] = 1.0, 0.0, 0.0
        self.learner.meta_parameters[:] = alpha / tilings, gamma, gamma * lambda_, temperature
        self.learner.low[:] = coding.low
        self.learner.high[:] = coding.high
        self.learner.offsets[:] = coding.offsets
        self.learner.tile_counts[:] = coding.tiles
        self._coding = coding
        self._start = partial(_start_packed, floats, integers)
        self._learn = partial(_learn_packed, floats, integers)

    def start(self, state: FloatArray, u: float) -> int:
        """Start an episode in `state` (d,); return the first action.

        Raises ValueError for a state of another shape than the tilings have.
        """
        if state.shape != self.learner.low.shape:
            raise ValueError(f"got {state.shape}, a state has shape {self.learner.low.shape}")
        return self._start(state, u)

    def step(self, reward: float, state: FloatArray, terminal: bool, u: float) -> int:
        """Learn from the last action's `reward` and next `state` (d,); return the next action.

        After a terminal state it is NO_ACTION, and `start` comes next.
        """
        return self._learn(reward, state, terminal, u)

    @property
    def temperature(self) -> float:
        """tau of the softmax; 0 is greedy. It may be set at any time.

        Raises ValueError if it is set to a negative number.
        """
        return float(self.learner.meta_parameters[TEMPERATURE])

    @temperature.setter
    def temperature(self, temperature: float) -> None:
        if not temperature >= 0.0:
            raise ValueError(f"a temperature is not negative, got {temperature}")
        self.learner.meta_parameters[TEMPERATURE] = temperature

    def weights(self) -> FloatArray:
        """Return a copy of Theta (n, actions), with all pending updates applied."""
        learner = self.learner
        renormalise(
            learner.weights,
            learner.traces,
            learner.traced_tiles,
            learner.totals,
            float(learner.meta_parameters[RATE]),
        )
        return learner.weights.copy()

    def action_values(self, state: FloatArray) -> FloatArray:
        """Return Q_s (actions,) of `state` (d,)."""
        active, _ = self._coding(state)
        return np.asarray(self.weights()[active].sum(axis=0), dtype=np.float64)
