"""Periodic things are done once a period, however often they are checked; changes are drawn at once."""

import itertools
from collections.abc import Iterable

import pytest
from crcolony_dashboards.throttle import ChangeDetector, Throttle
from hypothesis import given
from hypothesis import strategies as st

T = 1_790_000_000.0


def due(throttle: Throttle, times_s: Iterable[float]) -> list[float]:
    return [time_s for time_s in times_s if throttle.is_due(time_s)]


def test_the_first_call_is_due() -> None:
    """And not a second one at the same time."""
    assert due(Throttle(1.0), [T, T, T + 0.1]) == [T]


@pytest.mark.parametrize("period_s", [0.1, 0.5, 1.0, 2.0])
def test_frequent_calls_are_due_once_a_period(period_s: float) -> None:
    """At ten calls a second, a little early and a little late, no period is left out."""
    calls_s = [T + 0.1 * k + 0.004 * (k % 3) for k in range(1000)]
    due_s = len(due(Throttle(period_s), calls_s))
    assert due_s == pytest.approx(100.0 / period_s, abs=2.0)


@given(st.lists(st.floats(0.0, 3.0), max_size=200))
def test_due_times_are_at_least_half_a_period_apart(pauses_s: list[float]) -> None:
    """However long there was no call: missed periods are not made up for."""
    times_s = [T + sum(pauses_s[:k]) for k in range(len(pauses_s))]
    due_s = due(Throttle(1.0), times_s)
    assert all(later - earlier >= 0.5 for earlier, later in itertools.pairwise(due_s))


@given(st.lists(st.floats(0.0, 0.6), max_size=200))
def test_something_is_due_within_a_period(pauses_s: list[float]) -> None:
    """A call one period later is due, unless one in between was."""
    throttle, last_s = Throttle(1.0), T
    assert throttle.is_due(T)
    for pause_s in pauses_s:
        now_s = last_s + pause_s
        while now_s < last_s + 1.0 + 1e-6 and not throttle.is_due(now_s):
            now_s += 0.05
        assert now_s <= last_s + 1.05 + 1e-6
        last_s = now_s


def test_a_clock_that_is_set_back_does_not_block_it() -> None:
    """Nor is everything due all the time then."""
    throttle = Throttle(1.0)
    assert due(throttle, [T + 3600.0, T + 3601.0]) == [T + 3600.0, T + 3601.0]
    assert due(throttle, [T + 0.25 * k for k in range(17)]) == [T + k for k in range(5)]


class TestChangeDetector:
    """Unchanged values are due only from time to time, for viewers that connect late."""

    def test_a_changed_value_is_due_at_once(self) -> None:
        """With every detector, also back to an earlier value, and the first time."""
        detector = ChangeDetector(15.0)
        is_due = [
            detector.is_due(value, T + 0.1 * k) for k, value in enumerate([[1], [1], [2], [1], []])
        ]
        assert is_due == [True, False, True, True, True]
        assert ChangeDetector(15.0).is_due(None, T)

    def test_an_unchanged_value_is_due_after_a_while(self) -> None:
        """And again after the same time."""
        detector = ChangeDetector(15.0)
        times_s = [T + k for k in range(46)]
        assert [time_s for time_s in times_s if detector.is_due("x", time_s)] == times_s[::15]

    def test_a_clock_that_is_set_back_does_not_block_changes(self) -> None:
        """It counts as a long time."""
        detector = ChangeDetector(15.0)
        assert [detector.is_due("x", T + s) for s in (3600.0, 0.0, 1.0)] == [True, True, False]

    def test_nothing_is_repeated_where_time_passes_in_jumps(self) -> None:
        """As in the replay of a run of hundreds of hours; changes are due all the same."""
        detector = ChangeDetector(15.0)
        values = ["x", "x", "x", "y", "y"]
        is_due = [detector.is_due(value, T + 600.0 * k) for k, value in enumerate(values)]
        assert is_due == [True, False, False, True, False]
