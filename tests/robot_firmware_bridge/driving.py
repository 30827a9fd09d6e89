"""What tests of drivers do again and again: command a motion, and read until something is so."""

import time
from collections.abc import Callable

import numpy as np
from crcolony_bridge.driver import Driver, DriverState, Reading

from crcolony.body import contract
from crcolony.compiled import FloatArray
from tests.robot_firmware_bridge.printed_lines import PrintedLines


def drive(ttl_s: float = 0.25, left_m_s: float = 0.2, right_m_s: float = -0.1) -> FloatArray:
    """Return an action that turns the wheels."""
    action = np.zeros(contract.ACTION_WIDTH)
    action[contract.WHEEL_LEFT], action[contract.WHEEL_RIGHT] = left_m_s, right_m_s
    action[contract.TTL] = ttl_s
    return action


def any_reading(reading: Reading) -> bool:
    """Return whether it is one, for `read_until`."""
    return True


def read_until(driver: Driver, is_met: Callable[[Reading], bool], within_s: float = 5.0) -> Reading:
    """Return the first reading that meets a condition."""
    end_s = time.monotonic() + within_s
    while time.monotonic() < end_s:
        reading = driver.read(0.1)
        if reading is not None and is_met(reading):
            return reading
    raise AssertionError("no such reading")


def wait_for_state(driver: Driver, state: DriverState, within_s: float = 5.0) -> float:
    """Read until the driver is in a state; return how long that took (s)."""
    start_s = time.monotonic()
    while driver.state is not state:
        assert time.monotonic() - start_s < within_s, driver.state
        driver.read(0.02)
    return time.monotonic() - start_s


def drive_until(
    driver: Driver, robot: PrintedLines, line: str, action: FloatArray | None = None
) -> None:
    """Activate and command a motion again and again, as a robot does, until its firmware has printed a line."""
    since = max(len(robot.lines) - 1, 0)  # it may turn already
    end_s = time.monotonic() + 10.0
    while robot.match(line, since) is None:
        assert time.monotonic() < end_s, robot.lines
        driver.activate()
        driver.write(drive() if action is None else action)
        driver.read(0.02)
