"""The tests that every driver has to pass, and with it the tests of every body.

An author of a driver subclasses `DriverContract` in a test module, with a name that pytest collects, and implements
`new_driver`:

    class TestMyRobot(DriverContract):
        def new_driver(self) -> Driver:
            return MyRobot("tcp:127.0.0.1:4000")

The robot needs free space around it, so that its wheels can turn.
"""

import threading
import time
from collections.abc import Iterator

import numpy as np
import pytest

from crcolony.body import contract
from crcolony.body.contract_test import BodyContract, turn_action
from crcolony.compiled import FloatArray
from crcolony_bridge.driver import Driver, DriverState, Reading
from crcolony_bridge.driver_body import DriverBody

_WHEELS = slice(contract.WHEELS, contract.WHEELS + 2)
_MOVING_M_S = 0.05


class DriverContract(BodyContract):
    """The promises of `crcolony_bridge.driver.Driver`, each a test."""

    period_s = 0.1
    observations = 30
    wheel_tolerance_m_s = 0.02
    tolerance_periods = 2
    """A body stops when the last millisecond of its action has passed, and is asked at another time"""
    reopen_after_s = 0.0
    """How long a robot needs to notice that it was closed"""
    max_ttl_s = 0.5
    """The longest time to live that the robot accepts"""

    @pytest.fixture(autouse=True)
    def _closed(self) -> Iterator[None]:
        self._opened: list[Driver] = []
        yield
        for driver in self._opened:
            driver.close()

    def new_driver(self) -> Driver:
        """Return a driver that is closed, of a robot that stands still."""
        raise NotImplementedError

    def new_body(self) -> DriverBody:
        """Return the robot as a body."""
        return DriverBody(self._open(), self.period_s)

    def highest_action(self) -> FloatArray:
        """Return the highest action (ACTION_WIDTH,) that this robot can carry out."""
        highest = super().highest_action()
        limit_m_s = self._opened[-1].description.max_speed_m_s
        highest[[contract.WHEEL_LEFT, contract.WHEEL_RIGHT]] = limit_m_s
        highest[contract.TTL] = self.max_ttl_s
        return highest

    def test_a_robot_says_what_it_is(self) -> None:
        """Its model before it is connected, and its measures and its watchdog then."""
        driver = self.new_driver()
        assert driver.state is DriverState.CLOSED
        assert driver.description.model
        driver.open()
        self._opened.append(driver)
        robot = driver.description
        assert robot.uid
        assert 0.0 < robot.max_speed_m_s <= contract.ACTION[contract.WHEEL_LEFT].high
        assert robot.track_m > 0.0
        assert robot.watchdog == "none" or 0.0 < robot.watchdog_s <= 1.0

    def test_wheels_turn_only_while_it_is_active(self) -> None:
        """An action before `activate`, or after `deactivate`, turns no wheel, and `write` says so."""
        driver = self._open()
        assert driver.state is DriverState.INACTIVE
        assert self._wheels_of(driver.write(turn_action(0.4))) == [0.0, 0.0]
        assert not self._turns(driver)
        driver.activate()
        assert self._wheels_of(driver.write(turn_action(0.4))) != [0.0, 0.0]
        assert self._turns(driver)
        driver.deactivate()
        self._comes_to_rest(driver)
        driver.write(turn_action(0.4))
        assert not self._turns(driver)

    def test_an_emergency_stop_is_confirmed_and_latched(self) -> None:
        """By another thread than the one that reads; only `clear` releases it, and then it is inactive."""
        driver = self._open()
        driver.activate()
        driver.write(turn_action(0.5))
        assert self._turns(driver)
        confirmed: list[bool] = []
        stopping = threading.Thread(target=lambda: confirmed.append(driver.stop()))
        stopping.start()
        while stopping.is_alive():
            driver.read(0.02)
        assert confirmed == [True]
        self._comes_to_rest(driver)
        driver.activate()
        driver.write(turn_action(0.4))
        assert not self._turns(driver)
        assert driver.clear()
        assert driver.state is DriverState.INACTIVE
        driver.write(turn_action(0.4))
        assert not self._turns(driver)

    def test_a_robot_that_is_closed_stands_still(self) -> None:
        """And can be opened again."""
        driver = self._open()
        driver.activate()
        driver.write(turn_action(0.5))
        assert self._turns(driver)
        driver.close()
        assert driver.state is DriverState.CLOSED
        time.sleep(self.reopen_after_s)
        driver.open()
        self._comes_to_rest(driver)

    def _open(self) -> Driver:
        driver = self.new_driver()
        driver.open()
        self._opened.append(driver)
        return driver

    def _read(self, driver: Driver) -> Reading:
        reading = driver.read(2.0)
        assert reading is not None, driver.trouble
        return reading

    def _turns(self, driver: Driver) -> bool:
        """Return whether the wheels turn within the next 0.3 s."""
        until_s = time.monotonic() + 0.3
        while time.monotonic() < until_s:
            if np.abs(self._read(driver).row[_WHEELS]).max() > _MOVING_M_S:
                return True
        return False

    def _comes_to_rest(self, driver: Driver) -> None:
        """Check that the wheels stand still within a second."""
        until_s = time.monotonic() + 1.0
        while np.abs(self._read(driver).row[_WHEELS]).max() > _MOVING_M_S:
            assert time.monotonic() < until_s

    def _wheels_of(self, action: FloatArray) -> list[float]:
        return [float(action[contract.WHEEL_LEFT]), float(action[contract.WHEEL_RIGHT])]
