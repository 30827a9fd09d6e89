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
from tests.robot_firmware_bridge import driving


class NewRobot(Protocol):
    """Makes a driver that the test need not close."""

    def __call__(
        self, address: str, uid: str = "", connect: Callable[[str, int], Link] = open_link
    ) -> AsebaRobot:
        """Return a driver that is not connected yet."""
        ...


def drive(ttl_s: float = 0.25, left_m_s: float = 0.1, right_m_s: float = 0.1) -> FloatArray:
    """Return an action that these slower robots can carry out."""
    return driving.drive(ttl_s, left_m_s, right_m_s)


def read_for(driver: Driver, duration_s: float) -> list[Reading]:
    """Return all readings of a while."""
    end_s = time.monotonic() + duration_s
    readings = []
    while (left_s := end_s - time.monotonic()) > 0.0:
        if (reading := driver.read(left_s)) is not None:
            readings.append(reading)
    return readings


def wait_for_state(driver: Driver, state: DriverState) -> float:
    """Read until the driver is in a state; a simulator and a router take longer to be there. Return how long (s)."""
    return driving.wait_for_state(driver, state, within_s=8.0)


def turns(reading: Reading) -> bool:
    return bool(np.abs(reading.row[contract.WHEELS : contract.WHEELS + 2]).max() > 0.01)


def ahead_m(reading: Reading) -> float:
    return float(reading.row[contract.PROXIMITY + 3])
