"""A learner by Sarsa(lambda), Algorithm 2.2, to call once a step from Python.

To pass an array to compiled code costs as much as a step, so a `SarsaLambda` has all its arrays in
two blocks of memory, and compiled code unpacks them.
"""

from functools import partial

import numpy as np

from crcolony.compiled import FloatArray, IntArray, compiled
from crcolony.learning.features import TileCoding
from crcolony.learning.sarsa_lambda import (
    RATE,
    TEMPERATURE,
    Learner,
    learn_and_select,
    start_episode,
)
from crcolony.learning.traces import renormalise

_SIZES = 4
"""The block of integers begins with this number of sizes."""
_LAST_ACTION = _SIZES
"""Index of the last action in the block of integers."""


def unpack(floats: FloatArray, integers: IntArray) -> Learner:
    """Return the arrays of a learner, as views of the two blocks that a `SarsaLambda` keeps them
    in."""
    size, actions, tilings, dimensions = integers[0], integers[1], integers[2], integers[3]
    traces = size * actions
    totals = traces + size * 4
    meta_parameters = totals + 3
    values = meta_parameters + 4
    scratch = values + actions
    low = scratch + actions
    tiles_per_unit = low + dimensions
    offsets = tiles_per_unit + dimensions
    traced_tiles = _LAST_ACTION + 1
    active_tiles = traced_tiles + size
    next_tiles = active_tiles + tilings
    tile_counts = next_tiles + tilings
    return Learner(
        floats[:traces].reshape((size, actions)),
        floats[traces:totals].reshape((size, 4)),
        floats[totals:meta_parameters],
        floats[meta_parameters:values],
        floats[values:scratch],
        floats[scratch:low],
        floats[low:tiles_per_unit],
        floats[tiles_per_unit:offsets],
        floats[offsets:].reshape((tilings, dimensions)),
        integers[traced_tiles:active_tiles],
        integers[active_tiles:next_tiles],
        integers[next_tiles:tile_counts],
        integers[tile_counts:],
    )


_unpack = compiled(unpack)


@compiled
def _start_packed(floats: FloatArray, integers: IntArray, state: FloatArray, u: float) -> int:
    """Start an episode; return the first action."""
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
    """Learn from the last action; return the next one."""
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
            coding.size * (actions + 4) + 3 + 4 + 2 * actions + dimensions * (2 + tilings)
        )
        integers = np.zeros(_SIZES + 1 + coding.size + 2 * tilings + dimensions, dtype=np.int64)
        integers[:_SIZES] = coding.size, actions, tilings, dimensions
        self.learner = unpack(floats, integers)
        self.learner.weights[:] = initial_value / tilings
        self.learner.totals[:] = 1.0, 0.0, 0.0
        self.learner.meta_parameters[:] = alpha / tilings, gamma, gamma * lambda_, temperature
        self.learner.low[:] = coding.low
        self.learner.tiles_per_unit[:] = coding.tiles_per_unit
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
