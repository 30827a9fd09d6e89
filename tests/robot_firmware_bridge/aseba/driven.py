"""What the tests of the driver do with it: drive, read, and wait for what is to come."""

import time
from collections.abc import Callable
from typing import Protocol

import numpy as np
from crcolony_bridge.aseba.driver import AsebaRobot
from crcolony_bridge.driver import Driver, DriverState, Reading
from crcolony_bridge.link import Link, open_link

from crcolony.body import contract
from crcolony.compiled import FloatArray


class NewRobot(Protocol):
    """Makes a driver that the test need not close."""

    def __call__(
        self, address: str, uid: str = "", connect: Callable[[str, int], Link] = open_link
    ) -> AsebaRobot:
        """Return a driver that is not connected yet."""
        ...


def drive(ttl_s: float = 0.25, left_m_s: float = 0.1, right_m_s: float = 0.1) -> FloatArray:
    action = np.zeros(contract.ACTION_WIDTH)
    action[contract.WHEEL_LEFT], action[contract.WHEEL_RIGHT] = left_m_s, right_m_s
    action[contract.TTL] = ttl_s
    return action


def read_until(driver: Driver, is_met: Callable[[Reading], bool], within_s: float = 5.0) -> Reading:
    """Return the first reading that meets a condition."""
    end_s = time.monotonic() + within_s
    while time.monotonic() < end_s:
        reading = driver.read(0.2)
        if reading is not None and is_met(reading):
            return reading
    raise AssertionError("no such reading")


def read_for(driver: Driver, duration_s: float) -> list[Reading]:
    """Return all readings of a while."""
    end_s = time.monotonic() + duration_s
    readings = []
    while (left_s := end_s - time.monotonic()) > 0.0:
        if (reading := driver.read(left_s)) is not None:
            readings.append(reading)
    return readings


def wait_for_state(driver: Driver, state: DriverState, within_s: float = 8.0) -> float:
    """Read until the driver is in a state; return how long that took (s)."""
    start_s = time.monotonic()
    while driver.state is not state:
        assert time.monotonic() - start_s < within_s, driver.state
        driver.read(0.02)
    return time.monotonic() - start_s


def turns(reading: Reading) -> bool:
    return bool(np.abs(reading.row[contract.WHEELS : contract.WHEELS + 2]).max() > 0.01)


def ahead_m(reading: Reading) -> float:
    return float(reading.row[contract.PROXIMITY + 3])
