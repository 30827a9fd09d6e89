"""Odometry, distances and battery become the columns of an observation."""

import math

import numpy as np
import pytest
from crcolony_bridge.driver import PROXIMITY_BEARINGS_RAD
from crcolony_bridge.ros2.address import BASES, CREATE3
from crcolony_bridge.ros2.messages import (
    BatteryState,
    LaserScan,
    Odometry,
    Range,
    Twist,
    TwistWithCovariance,
    Vector3,
)
from crcolony_bridge.ros2.senses import (
    NO_DISTANCES,
    battery_level,
    distances_of_ranges,
    distances_of_scan,
    is_finite,
    observe,
    twist_of,
    wheel_speeds_m_s,
)
from hypothesis import given
from hypothesis import strategies as st

from crcolony.body import contract
from crcolony.body.contract import OBSERVATION, limits

NUMBERS = st.floats(width=32)


def odometry(ahead_m_s: float, turn_rad_s: float) -> Odometry:
    twist = Twist(Vector3(x=ahead_m_s), Vector3(z=turn_rad_s))
    return Odometry(twist=TwistWithCovariance(twist))


def scan(distances_m: dict[int, float]) -> LaserScan:
    """Return a scan with a ray for every degree from -180 on, and a distance at some."""
    ranges = [distances_m.get(degrees, math.inf) for degrees in range(-180, 180)]
    return LaserScan(
        angle_min=-math.pi,
        angle_increment=math.radians(1.0),
        range_min=0.15,
        range_max=12.0,
        ranges=tuple(ranges),
    )


def proximity_m(distances_m: dict[int, float]) -> list[float]:
    row = observe(odometry(0.0, 0.0), distances_of_scan(scan(distances_m), CREATE3), None, CREATE3)
    return row[contract.PROXIMITY : contract.PROXIMITY + 7].tolist()  # type: ignore[no-any-return]


@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_wheels_and_twists_are_the_same_motion(left_m_s: float, right_m_s: float) -> None:
    """What is commanded is what odometry is turned back to."""
    ahead_m_s, turn_rad_s = twist_of(left_m_s, right_m_s, CREATE3)
    measured = wheel_speeds_m_s(odometry(ahead_m_s, turn_rad_s), CREATE3)
    assert measured == pytest.approx((left_m_s, right_m_s), abs=1e-12)


def test_a_turn_to_the_left_has_a_faster_right_wheel() -> None:
    """And a positive turning rate."""
    assert twist_of(0.1, 0.2, CREATE3) == pytest.approx((0.15, 0.1 / 0.233))
    row = observe(odometry(0.15, 0.1 / 0.233), NO_DISTANCES, None, CREATE3)
    assert row[contract.WHEELS : contract.WHEELS + 2] == pytest.approx([0.1, 0.2])
    assert row[contract.GYRO] == pytest.approx(0.1 / 0.233)


def test_nothing_around_is_the_range_of_the_sensors() -> None:
    """And a battery that is not measured is full."""
    row = observe(odometry(0.0, 0.0), NO_DISTANCES, None, CREATE3)
    assert (row[contract.PROXIMITY : contract.PROXIMITY + 7] == 0.3).all()
    assert row[contract.IR_RANGE] == 1.0
    assert row[contract.BATTERY] == 1.0
    assert row[contract.ENCOUNTER_ROBOT] == -1.0


def test_each_column_has_the_nearest_distance_of_its_sector() -> None:
    """From the hull, not from the scanner; column 0 is rightmost, and nobody looks back."""
    assert np.degrees(PROXIMITY_BEARINGS_RAD) == pytest.approx([-90, -60, -30, 0, 30, 60, 90])
    assert proximity_m({0: 0.37, 10: 0.27, 20: 0.45})[3:5] == pytest.approx([0.1, 0.28])
    assert proximity_m({-90: 0.2, 104: 0.3})[::6] == pytest.approx([0.03, 0.13])
    assert proximity_m({-110: 0.2, 180 - 360: 0.2, 150: 0.2}) == [0.3] * 7
    assert proximity_m({0: 0.16})[3] == 0.0


def test_the_range_sensor_looks_straight_ahead_and_farther() -> None:
    """Up to a metre, as a simulated one."""
    distances = distances_of_scan(scan({4: 0.9, 7: 0.5}), CREATE3)
    row = observe(odometry(0.0, 0.0), distances, None, CREATE3)
    assert row[contract.IR_RANGE] == pytest.approx(0.73)


def test_a_scanner_that_is_mounted_turned_is_turned_back() -> None:
    """A TurtleBot 4's looks to the left where it says ahead."""
    ((bearing_rad, _),) = distances_of_scan(scan({-90: 1.0}), BASES["turtlebot4"])
    assert bearing_rad == pytest.approx(0.0, abs=1e-6)
    ((bearing_rad, _),) = distances_of_scan(scan({150: 1.0}), BASES["turtlebot4"])
    assert math.degrees(bearing_rad) == pytest.approx(-120.0)


def test_what_is_no_measurement_is_left_out() -> None:
    """NaN and what is out of range; minus infinity is something too near to be measured (REP 117)."""
    assert distances_of_scan(scan({0: math.nan, 1: 0.1, 2: 13.0}), CREATE3).size == 0
    ((_, distance_m),) = distances_of_scan(scan({0: -math.inf}), CREATE3)
    assert distance_m == 0.0
    assert distances_of_scan(LaserScan(angle_increment=math.nan, ranges=(1.0,)), CREATE3).size == 0


def test_single_sensors_measure_from_where_they_are() -> None:
    """Each at its own bearing, within its own range."""
    near, none = Range(min_range=0.02, max_range=1.0, range=0.2), Range(range=math.inf)
    assert distances_of_ranges([(0.5, near), (0.0, none)]).tolist() == [[0.5, 0.2]]


def test_a_battery_is_a_level_or_unknown() -> None:
    """Between empty and full."""
    percentages = (0.4, 1.2, -1.0, math.nan)
    levels = [battery_level(BatteryState(percentage=percentage)) for percentage in percentages]
    assert levels == [0.4, 1.0, 0.0, None]


def test_odometry_without_numbers_is_told() -> None:
    """It says nothing of how the base moves."""
    assert is_finite(odometry(0.1, 0.2).twist.twist)
    assert not is_finite(odometry(math.nan, 0.0).twist.twist)
    assert not is_finite(odometry(0.0, math.inf).twist.twist)


@given(
    st.floats(-1e3, 1e3),
    st.builds(
        LaserScan,
        angle_min=NUMBERS,
        angle_increment=NUMBERS,
        range_min=NUMBERS,
        range_max=NUMBERS,
        ranges=st.lists(NUMBERS, max_size=9).map(tuple),
    ),
    st.builds(Range, min_range=NUMBERS, max_range=NUMBERS, range=NUMBERS),
    st.builds(BatteryState, percentage=NUMBERS),
)
def test_observations_are_within_the_limits(
    speed: float, scan: LaserScan, single: Range, battery: BatteryState
) -> None:
    """Whatever a robot publishes."""
    distances = np.concatenate(
        [distances_of_scan(scan, CREATE3), distances_of_ranges([(0.1, single)])]
    )
    row = observe(odometry(speed, -speed), distances, battery_level(battery), CREATE3)
    low, high = limits(OBSERVATION)
    assert np.isfinite(row).all()
    assert ((row >= low) & (row <= high)).all()
