"""The length of a robot's tick is measured, and a time to live is counted in whole ticks."""

import pytest
from crcolony_bridge.aseba.ticks import TickClock


def counted(tick_s: float, readings: int, ticks_a_reading: int = 1, first: int = 0) -> TickClock:
    """Return a clock that has heard readings at their time."""
    clock = TickClock()
    for k in range(readings):
        ticks = k * ticks_a_reading
        clock.add(100.0 + ticks * tick_s, (first + ticks) & 0xFFFF)
    return clock


@pytest.mark.parametrize(("tick_s", "ticks_a_reading"), [(0.03, 1), (0.01, 10)])
def test_a_tick_is_measured_with_every_rate_of_readings(
    tick_s: float, ticks_a_reading: int
) -> None:
    """With one tick a reading, or ten."""
    clock = counted(tick_s, 20, ticks_a_reading)
    assert clock.is_calibrated
    assert clock.tick_s == pytest.approx(tick_s)
    assert clock.period_s == pytest.approx(tick_s * ticks_a_reading)


def test_a_count_that_wraps_goes_on() -> None:
    """Also the robot's own time."""
    clock = counted(0.03, 40, first=0xFFF0)
    assert clock.tick_s == pytest.approx(0.03)
    assert clock.time_s == pytest.approx(39 * 0.03)


def test_nothing_is_known_before_some_readings() -> None:
    """A robot is not driven before; a time to live is no tick then."""
    clock = counted(0.03, 3)
    assert not clock.is_calibrated
    assert TickClock().count_of(1.0) == 0


def test_a_tick_that_has_begun_is_completed() -> None:
    """But a time to live of 0 is none."""
    clock = counted(0.03, 20)
    assert [clock.count_of(ttl_s) for ttl_s in (0.0, 0.001, 0.03, 0.031, 0.3)] == [0, 1, 1, 2, 10]


def test_a_reading_that_is_late_hardly_counts() -> None:
    """This machine was busy, not the robot."""
    clock = TickClock()
    for k in range(10):
        clock.add(100.0 + 0.03 * k + (0.05 if k in (0, 7) else 0.0), k)
    assert clock.tick_s == pytest.approx(0.03)


def test_a_robot_that_becomes_slower_is_measured_anew() -> None:
    """The last readings count."""
    clock = counted(0.03, 20)
    last_s = 100.0 + 19 * 0.03
    for k in range(1, 80):
        clock.add(last_s + 0.05 * k, 19 + k)
    assert clock.tick_s == pytest.approx(0.05)
