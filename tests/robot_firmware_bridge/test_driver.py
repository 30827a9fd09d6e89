"""What a robot can carry out of an action."""

import numpy as np
import pytest
from crcolony_bridge.driver import (
    RobotDescription,
    empty_observation,
    limited_action,
    observe_distances,
)
from hypothesis import given
from hypothesis import strategies as st

from crcolony.body import contract
from crcolony.body.contract import ACTION, limits

ROBOT = RobotDescription("slow", max_speed_m_s=0.2, battery_empty_v=3.0, battery_full_v=4.0)
ACTIONS = st.lists(
    st.floats(-10.0, 10.0), min_size=contract.ACTION_WIDTH, max_size=contract.ACTION_WIDTH
).map(np.array)
WHEELS = [contract.WHEEL_LEFT, contract.WHEEL_RIGHT]


@given(ACTIONS, st.floats(0.0, 1.0))
def test_it_is_within_all_limits(action: np.ndarray, max_ttl_s: float) -> None:
    """Of the contract, and of the robot."""
    low, high = limits(ACTION)
    applied = limited_action(action, ROBOT, max_ttl_s, may_move=True)
    assert ((applied >= low) & (applied <= high)).all()
    assert np.abs(applied[WHEELS]).max() <= 0.2 + 1e-12
    assert applied[contract.TTL] <= max_ttl_s


@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_a_curve_stays_the_same_curve(left_m_s: float, right_m_s: float) -> None:
    """A wheel that would have to be faster than it can slows down the other one."""
    action = np.zeros(contract.ACTION_WIDTH)
    action[WHEELS] = left_m_s, right_m_s
    left, right = limited_action(action, ROBOT, 0.5, may_move=True)[WHEELS]
    assert left * right_m_s == pytest.approx(right * left_m_s)


@given(ACTIONS)
def test_without_leave_to_move_no_wheel_turns(action: np.ndarray) -> None:
    """Whatever is asked."""
    assert not limited_action(action, ROBOT, 0.5, may_move=False)[WHEELS].any()


def test_a_battery_is_between_empty_and_full() -> None:
    """And unknown for a robot that does not measure it."""
    assert [ROBOT.battery_level(v) for v in (2.0, 3.0, 3.25, 4.0, 5.0)] == [0, 0, 0.25, 1, 1]
    assert RobotDescription("blind").battery_level(3.7) == 0.0


def test_a_column_has_the_nearest_of_what_is_nearest_to_its_bearing() -> None:
    """From right to left; what is straight ahead the range sensor has, too, and what is behind nobody has."""
    row = empty_observation(0.5)
    bearings_deg = np.array([-80.0, 3.0, -10.0, 35.0, 31.0, 120.0])
    observe_distances(row, np.radians(bearings_deg), np.array([0.1, 0.2, 0.15, 0.4, 0.3, 0.05]))
    columns = row[contract.PROXIMITY : contract.PROXIMITY + contract.PROXIMITY_SENSORS]
    assert columns.tolist() == [0.1, 0.5, 0.5, 0.15, 0.3, 0.5, 0.5]
    assert row[contract.IR_RANGE] == 0.2
