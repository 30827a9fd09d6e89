"""A robot that nothing stops is refused, and it is said what helps."""

import pytest
from crcolony_bridge.driver import RobotDescription
from crcolony_bridge.errors import DeviceError
from crcolony_bridge.watchdog_rule import check_watchdog


def test_a_robot_without_a_watchdog_is_refused() -> None:
    """In one line, with its name."""
    with pytest.raises(DeviceError, match=r"desk: nothing stops its wheels .* --without-watchdog"):
        check_watchdog("desk", RobotDescription("robot"), is_needed=True)


def test_a_person_may_allow_it() -> None:
    """And a robot that has one is always welcome."""
    check_watchdog("desk", RobotDescription("robot"), is_needed=False)
    check_watchdog("desk", RobotDescription("robot", watchdog="firmware"), is_needed=True)
