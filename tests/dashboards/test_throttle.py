"""What is done every so often is done so often, whoever asks how often; and what has changed is drawn at once."""

import itertools
from collections.abc import Iterable

import pytest
from crcolony_dashboards.throttle import ChangeDetector, Throttle
from hypothesis import given
from hypothesis import strategies as st

T = 1_790_000_000.0


def due(beat: Throttle, times_s: Iterable[float]) -> list[float]:
    return [time_s for time_s in times_s if beat.is_due(time_s)]


def test_the_first_time_is_at_once() -> None:
    """And not a second time in the same moment."""
    assert due(Throttle(1.0), [T, T, T + 0.1]) == [T]


@pytest.mark.parametrize("period_s", [0.1, 0.5, 1.0, 2.0])
def test_who_asks_often_is_told_once_a_period(period_s: float) -> None:
    """Ten times a second, a little early and a little late in turn: no beat is left out."""
    asks = [T + 0.1 * k + 0.004 * (k % 3) for k in range(1000)]
    beats = len(due(Throttle(period_s), asks))
    assert beats == pytest.approx(100.0 / period_s, abs=2.0)


@given(st.lists(st.floats(0.0, 3.0), max_size=200))
def test_beats_are_never_less_than_half_a_period_apart(pauses_s: list[float]) -> None:
    """However long nobody asked: what was missed is not made up for."""
    times_s = [T + sum(pauses_s[:k]) for k in range(len(pauses_s))]
    beats = due(Throttle(1.0), times_s)
    assert all(later - earlier >= 0.5 for earlier, later in itertools.pairwise(beats))


@given(st.lists(st.floats(0.0, 0.6), max_size=200))
def test_nobody_waits_longer_than_a_period(pauses_s: list[float]) -> None:
    """Whoever asks a period later is told yes, or was told so in between."""
    beat, last_s = Throttle(1.0), T
    assert beat.is_due(T)
    for pause_s in pauses_s:
        now_s = last_s + pause_s
        while now_s < last_s + 1.0 + 1e-6 and not beat.is_due(now_s):
            now_s += 0.05
        assert now_s <= last_s + 1.05 + 1e-6
        last_s = now_s


def test_a_clock_that_is_set_back_holds_up_nothing() -> None:
    """Nor does it make everything due all the time."""
    beat = Throttle(1.0)
    assert due(beat, [T + 3600.0, T + 3601.0]) == [T + 3600.0, T + 3601.0]
    assert due(beat, [T + 0.25 * k for k in range(17)]) == [T + k for k in range(5)]


class TestChange:
    """What looks the same is drawn again only now and then, for viewers that come late."""

    def test_what_has_changed_is_due_at_once(self) -> None:
        """Each time that it looks otherwise, back and forth too; the first time always."""
        change = ChangeDetector(15.0)
        message = [
            change.is_due(what, T + 0.1 * k) for k, what in enumerate([[1], [1], [2], [1], []])
        ]
        assert message == [True, False, True, True, True]
        assert ChangeDetector(15.0).is_due(None, T)

    def test_what_has_not_is_due_after_a_while(self) -> None:
        """Whatever it is, and again after as long."""
        change = ChangeDetector(15.0)
        times_s = [T + k for k in range(46)]
        assert [time_s for time_s in times_s if change.is_due("x", time_s)] == times_s[::15]

    def test_a_clock_that_is_set_back_does_not_hold_it_up(self) -> None:
        """It is as if much time had passed."""
        change = ChangeDetector(15.0)
        assert [change.is_due("x", T + s) for s in (3600.0, 0.0, 1.0)] == [True, True, False]
