"""Sarsa(lambda) with tile coding and replacing traces with the optional clearing, Algorithm 2.2.

`begin` and `advance` are the algorithm, compiled, over the arrays of one `Learner`. A compiled
loop calls them directly; anything else drives a `SarsaLambda`, one call a step. What the algorithm
is printed without: after a step, s <- s', a <- a', I_s <- I_s'; and the value of a terminal state
is 0.
"""

from functools import partial
from typing import NamedTuple

import numpy as np

from crcolony.compiled import FloatArray, IntArray, compiled
from crcolony.learning.features import TileCoding, tile_indices
from crcolony.learning.policies import softmax
from crcolony.learning.traces import action_values, forget, learn, renew, visit

RATE, GAMMA, GAMMA_LAMBDA, TEMPERATURE = 0, 1, 2, 3
NO_ACTION = -1
LAST_ACTION = 4  # its place in the block of whole numbers, after the four sizes


class Learner(NamedTuple):
    """All arrays of one learner: n tiles in N tilings over d dimensions."""

    weights: FloatArray  # (n, actions) Theta
    traces: FloatArray  # (n, 3), see traces.py
    clock: FloatArray  # (3,)
    settings: FloatArray  # (4,) RATE = alpha / N, GAMMA, GAMMA_LAMBDA, TEMPERATURE
    values: FloatArray  # (actions,) Q_s
    scratch: FloatArray  # (actions,)
    low: FloatArray  # (d,)
    high: FloatArray  # (d,)
    offsets: FloatArray  # (N, d)
    live: IntArray  # (n,)
    active: IntArray  # (N,) I_s
    tiles: IntArray  # (d,) along each axis


@compiled
def choose(learner: Learner, state: FloatArray, u: float) -> int:
    """Find I_s and Q_s of `state` (d,), and select an action by softmax."""
    tile_indices(state, learner.low, learner.high, learner.tiles, learner.offsets, learner.active)
    action_values(
        learner.weights,
        learner.traces,
        learner.clock,
        learner.active,
        learner.settings[RATE],
        learner.values,
    )
    return softmax(learner.values, learner.settings[TEMPERATURE], learner.scratch, u)


@compiled
def mark(learner: Learner, action: int) -> None:
    """Fade the traces, and set those of I_s and `action`."""
    visit(
        learner.weights,
        learner.traces,
        learner.live,
        learner.clock,
        learner.active,
        action,
        learner.settings[GAMMA_LAMBDA],
        learner.settings[RATE],
    )


@compiled
def end(learner: Learner) -> None:
    """e <- 0; every weight has got what it was owed."""
    rate = learner.settings[RATE]
    forget(learner.weights, learner.traces, learner.live, learner.clock, rate)


@compiled
def begin(learner: Learner, state: FloatArray, u: float) -> int:
    """Start an episode in `state` (d,); the first action."""
    end(learner)
    action = choose(learner, state, u)
    mark(learner, action)
    return action


@compiled
def advance(
    learner: Learner, action: int, reward: float, state: FloatArray, terminal: bool, u: float
) -> int:
    """Learn from the `reward` and next `state` (d,) that `action` led to; the next action.

    `action` is the answer to the last `begin` or `advance`. After a terminal state it is -1.
    """
    delta = reward
    for position in range(learner.active.shape[0]):  # just visited: nothing is owed to them
        delta -= learner.weights[learner.active[position], action]
    if terminal:
        learn(learner.clock, delta)
        end(learner)
        return NO_ACTION
    action = choose(learner, state, u)
    learn(learner.clock, delta + learner.settings[GAMMA] * learner.values[action])
    mark(learner, action)
    return action


def unpack(numbers: FloatArray, whole: IntArray) -> Learner:
    """The arrays of a learner, as views of the two blocks that `SarsaLambda` keeps them in."""
    size, actions, tilings, dimensions = whole[0], whole[1], whole[2], whole[3]
    traces = size * actions
    clock = traces + size * 3
    settings = clock + 3
    values = settings + 4
    scratch = values + actions
    low = scratch + actions
    high = low + dimensions
    offsets = high + dimensions
    live = LAST_ACTION + 1
    active = live + size
    tiles = active + tilings
    return Learner(
        numbers[:traces].reshape((size, actions)),
        numbers[traces:clock].reshape((size, 3)),
        numbers[clock:settings],
        numbers[settings:values],
        numbers[values:scratch],
        numbers[scratch:low],
        numbers[low:high],
        numbers[high:offsets],
        numbers[offsets:].reshape((tilings, dimensions)),
        whole[live:active],
        whole[active:tiles],
        whole[tiles:],
    )


unpack_compiled = compiled(unpack)


@compiled
def begin_packed(numbers: FloatArray, whole: IntArray, state: FloatArray, u: float) -> int:
    """`begin`, for a caller in Python: handing over an array costs it as much as a small step."""
    action = begin(unpack_compiled(numbers, whole), state, u)
    whole[LAST_ACTION] = action
    return action


@compiled
def advance_packed(
    numbers: FloatArray, whole: IntArray, reward: float, state: FloatArray, terminal: bool, u: float
) -> int:
    """`advance` from the last action, for a caller in Python."""
    action = advance(
        unpack_compiled(numbers, whole), whole[LAST_ACTION], reward, state, terminal, u
    )
    whole[LAST_ACTION] = action
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
        self._numbers = np.zeros(
            coding.size * (actions + 3) + 3 + 4 + 2 * actions + dimensions * (2 + tilings)
        )
        self._whole = np.zeros(5 + coding.size + tilings + dimensions, dtype=np.int64)
        self._whole[:4] = coding.size, actions, tilings, dimensions
        self.learner = unpack(self._numbers, self._whole)
        self.learner.weights[:] = initial_value / tilings
        self.learner.clock[:] = 1.0, 0.0, 0.0
        self.learner.settings[:] = alpha / tilings, gamma, gamma * lambda_, temperature
        self.learner.low[:] = coding.low
        self.learner.high[:] = coding.high
        self.learner.offsets[:] = coding.offsets
        self.learner.tiles[:] = coding.tiles
        self._coding = coding
        self._begin = partial(begin_packed, self._numbers, self._whole)
        self._advance = partial(advance_packed, self._numbers, self._whole)

    def start(self, state: FloatArray, u: float) -> int:
        """Begin an episode in `state`; the first action.

        Raises ValueError for a state of another shape than the tilings have.
        """
        if state.shape != self.learner.low.shape:
            raise ValueError(f"got {state.shape}, a state has shape {self.learner.low.shape}")
        return self._begin(state, u)

    def step(self, reward: float, state: FloatArray, terminal: bool, u: float) -> int:
        """Learn from the last action's `reward` and next `state`; the next action.

        After a terminal state there is none, -1, and `start` comes next.
        """
        return self._advance(reward, state, terminal, u)

    @property
    def temperature(self) -> float:
        """tau of the softmax; 0 is greedy. It may be set at any time."""
        return float(self.learner.settings[TEMPERATURE])

    @temperature.setter
    def temperature(self, temperature: float) -> None:
        if not temperature >= 0.0:
            raise ValueError(f"a temperature is not negative, got {temperature}")
        self.learner.settings[TEMPERATURE] = temperature

    def weights(self) -> FloatArray:
        """Theta (n, actions) with everything paid; a copy."""
        weights, traces, clock, settings, *_ = self.learner
        renew(weights, traces, self.learner.live, clock, float(settings[RATE]))
        return weights.copy()

    def action_values(self, state: FloatArray) -> FloatArray:
        """Q_s (actions,) of `state`."""
        active, _ = self._coding(state)
        return np.asarray(self.weights()[active].sum(axis=0), dtype=np.float64)
