"""Traces are those of eq. 2.16 and 2.17, and lazy ones give the weights that dense ones give."""

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crcolony.compiled import FloatArray, IntArray
from crcolony.learning.traces import (
    COUNT,
    DECAY,
    SCALE,
    accumulate,
    accumulate_error,
    action_values,
    clear_traces,
    renormalise,
    replace,
    replace_and_clear,
    set_traces,
    truncate,
)

TILES, ACTIONS, TILINGS, RATE = 12, 3, 2, 0.25

FIRST, SECOND = np.array([0]), np.array([1])
ONE = np.ones(1)


def test_accumulating_traces_follow_equation_2_16() -> None:
    """A trace grows by 1 with each visit and fades in between: 1, 1.5, 0.75, 1.375."""
    e = np.zeros((2, 2))
    table = []
    for state, action in [(FIRST, 0), (FIRST, 0), (SECOND, 1), (FIRST, 0)]:
        accumulate(e, state, ONE, action, 0.5)
        table.append(e.ravel().tolist())
    assert table == [
        [1.0, 0.0, 0.0, 0.0],
        [1.5, 0.0, 0.0, 0.0],
        [0.75, 0.0, 0.0, 1.0],
        [1.375, 0.0, 0.0, 0.5],
    ]


def test_replacing_traces_never_exceed_one() -> None:
    """A revisit sets the trace to 1 again, and leaves the other action of the state alone."""
    e = np.zeros((2, 2))
    table = []
    for state, action in [(FIRST, 0), (FIRST, 0), (FIRST, 1), (SECOND, 0)]:
        replace(e, state, action, 0.5)
        table.append(e.ravel().tolist())
    assert table == [
        [1.0, 0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0, 0.0],
        [0.5, 1.0, 0.0, 0.0],
        [0.25, 0.5, 1.0, 0.0],
    ]


def test_clearing_follows_equation_2_17() -> None:
    """A revisit with another action ends the trace of the first."""
    e = np.zeros((2, 2))
    table = []
    for state, action in [(FIRST, 0), (SECOND, 0), (FIRST, 1), (SECOND, 1)]:
        replace_and_clear(e, state, action, 0.5)
        table.append(e.ravel().tolist())
    assert table == [
        [1.0, 0.0, 0.0, 0.0],
        [0.5, 0.0, 1.0, 0.0],
        [0.0, 1.0, 0.5, 0.0],
        [0.0, 0.5, 0.0, 1.0],
    ]


def test_truncation_keeps_the_last_m_steps() -> None:
    """With m = 2, traces of now and of the two steps before stay."""
    e = np.zeros((4, 1))
    for state in range(4):
        replace(e, np.array([state]), 0, 0.5)
        truncate(e, 0.5, 2)
    assert e.ravel().tolist() == [0.0, 0.25, 0.5, 1.0]


@dataclass(frozen=True)
class Step:
    """One step of a history: active tiles, action, TD error, and how far traces fade."""

    tiles: IntArray
    action: int
    delta: float
    gamma_lambda: float


@dataclass(frozen=True)
class Lazy:
    """The arrays of a learner with lazy traces."""

    weights: FloatArray
    traces: FloatArray
    traced_tiles: IntArray
    totals: FloatArray

    @classmethod
    def new(cls) -> "Lazy":
        return cls(
            np.zeros((TILES, ACTIONS)),
            np.zeros((TILES, 4)),
            np.zeros(TILES, dtype=np.int64),
            np.array([1.0, 0.0, 0.0]),
        )

    def apply(self, step: Step) -> None:
        """Set the traces of `step` and accumulate its error."""
        set_traces(
            self.weights,
            self.traces,
            self.traced_tiles,
            self.totals,
            step.tiles,
            step.tiles,
            step.action,
            step.gamma_lambda,
            RATE,
        )
        accumulate_error(self.totals, step.delta)


fades = st.one_of(st.just(0.0), st.just(1.0), st.just(1e-9), st.just(5e-324), st.floats(0.0, 1.0))


@st.composite
def histories(draw: st.DrawFn) -> list[Step]:
    """Up to 400 steps; gamma lambda is the same throughout, or another one in each step."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    steps = draw(st.integers(1, 400))
    palette = draw(st.lists(fades, min_size=1, max_size=3))
    half = TILES // TILINGS
    return [
        Step(
            np.arange(TILINGS) * half + rng.integers(half, size=TILINGS),
            int(rng.integers(ACTIONS)),
            float(rng.normal()),
            float(rng.choice(palette)),
        )
        for _ in range(steps)
    ]


@given(histories())
def test_lazy_traces_update_weights_as_dense_traces_do(history: list[Step]) -> None:
    """Values in every step and weights at the end equal those of equations 2.15 and 2.17."""
    lazy = Lazy.new()
    theta = np.zeros((TILES, ACTIONS))
    e = np.zeros((TILES, ACTIONS))
    values = np.empty(ACTIONS)
    for step in history:
        action_values(lazy.weights, lazy.traces, lazy.totals, step.tiles, step.tiles, RATE, values)
        np.testing.assert_allclose(values, theta[step.tiles].sum(axis=0), atol=1e-8)
        lazy.apply(step)
        replace_and_clear(e, step.tiles, step.action, step.gamma_lambda)
        theta += RATE * step.delta * e
    clear_traces(lazy.weights, lazy.traces, lazy.traced_tiles, lazy.totals, RATE)
    np.testing.assert_allclose(lazy.weights, theta, atol=1e-8)


@given(histories())
def test_every_tile_with_a_trace_is_listed_once(history: list[Step]) -> None:
    """After any history, the first COUNT entries are exactly the tiles whose SCALE is not 0."""
    lazy = Lazy.new()
    for step in history:
        lazy.apply(step)
    listed = lazy.traced_tiles[: int(lazy.totals[COUNT])]
    assert sorted(listed) == np.flatnonzero(lazy.traces[:, SCALE]).tolist()


@given(histories())
def test_nothing_is_pending_after_renormalising(history: list[Step]) -> None:
    """A second `renormalise` changes no weight."""
    lazy = Lazy.new()
    for step in history:
        lazy.apply(step)
    renormalise(lazy.weights, lazy.traces, lazy.traced_tiles, lazy.totals, RATE)
    expected = lazy.weights.copy()
    renormalise(lazy.weights, lazy.traces, lazy.traced_tiles, lazy.totals, RATE)
    np.testing.assert_array_equal(lazy.weights, expected)


@given(histories(), st.floats(-10.0, 10.0))
def test_a_cleared_trace_updates_nothing(history: list[Step], delta: float) -> None:
    """After `clear_traces`, an error changes no weight."""
    lazy = Lazy.new()
    for step in history:
        lazy.apply(step)
    clear_traces(lazy.weights, lazy.traces, lazy.traced_tiles, lazy.totals, RATE)
    assert lazy.totals.tolist() == [1.0, 0.0, 0.0]
    before = lazy.weights.copy()
    accumulate_error(lazy.totals, delta)
    clear_traces(lazy.weights, lazy.traces, lazy.traced_tiles, lazy.totals, RATE)
    np.testing.assert_array_equal(lazy.weights, before)


def test_traces_that_have_faded_to_nothing_are_cleared() -> None:
    """A tile that is not active again leaves the list, while one that is active in every step
    stays."""
    lazy = Lazy.new()
    lazy.apply(Step(np.array([0, 6]), 0, 1.0, 0.1))
    for _ in range(40):
        lazy.apply(Step(np.array([1, 7]), 0, 1.0, 0.1))
    assert lazy.totals[COUNT] == 2
    assert lazy.totals[DECAY] > 1e-5
    assert sorted(lazy.traced_tiles[:2]) == [1, 7]


def episode_updates(accumulating: bool) -> tuple[FloatArray, FloatArray, list[int], list[float]]:
    """Return the sum of the updates of offline TD(1) over a random episode, with V, states and
    rewards."""
    rng = np.random.default_rng(3)
    v = rng.normal(size=5)
    states = rng.integers(5, size=30).tolist()
    rewards = rng.normal(size=30).tolist()
    e = np.zeros((5, 1))
    updates = np.zeros(5)
    for t, state in enumerate(states):
        if accumulating:
            accumulate(e, np.array([state]), ONE, 0, 1.0)
        else:
            replace(e, np.array([state]), 0, 1.0)
        value_next = v[states[t + 1]] if t + 1 < len(states) else 0.0
        updates += (rewards[t] + value_next - v[state]) * e[:, 0]
    return updates, v, states, rewards


def test_accumulating_traces_with_lambda_one_are_every_visit_monte_carlo() -> None:
    """Offline and undiscounted, each visit adds the error of its own return."""
    updates, v, states, rewards = episode_updates(accumulating=True)
    returns = np.cumsum(rewards[::-1])[::-1]
    expected = np.zeros(5)
    for t, state in enumerate(states):
        expected[state] += returns[t] - v[state]
    np.testing.assert_allclose(updates, expected, atol=1e-12)


def test_replacing_traces_with_lambda_one_are_first_visit_monte_carlo() -> None:
    """Offline and undiscounted, only the return of a first visit counts (Singh, Sutton 1996)."""
    updates, v, states, rewards = episode_updates(accumulating=False)
    returns = np.cumsum(rewards[::-1])[::-1]
    expected = [returns[states.index(state)] - v[state] for state in range(5)]
    np.testing.assert_allclose(updates, expected, atol=1e-12)


@pytest.mark.parametrize("gamma_lambda", [0.0, 0.5, 0.999, 1.0])
def test_long_episodes_stay_precise(gamma_lambda: float) -> None:
    """After 20000 steps of one episode, lazy weights are within 1e-8 of dense ones."""
    rng = np.random.default_rng(4)
    lazy = Lazy.new()
    theta = np.zeros((TILES, ACTIONS))
    e = np.zeros((TILES, ACTIONS))
    for _ in range(20_000):
        tiles = np.array([rng.integers(6), 6 + rng.integers(6)])
        step = Step(tiles, int(rng.integers(ACTIONS)), float(rng.normal()), gamma_lambda)
        lazy.apply(step)
        replace_and_clear(e, step.tiles, step.action, gamma_lambda)
        theta += RATE * step.delta * e
    clear_traces(lazy.weights, lazy.traces, lazy.traced_tiles, lazy.totals, RATE)
    np.testing.assert_allclose(lazy.weights, theta, atol=1e-8)
