"""A thread drives an attached robot: newest action, newest reading, and no motion without a driver or under a stop."""

import dataclasses
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from crcolony_bridge.attached_robot import AttachedRobot
from crcolony_bridge.driver import DriverState
from crcolony_bridge.errors import DeviceError

from crcolony.body import contract
from crcolony.compiled import FloatArray
from tests.robot_firmware_bridge.fake_driver import BrokenDriver, FakeDriver, reading
from tests.support.process import wait_until


class Setup:
    """An attached robot that runs, and what it printed."""

    def __init__(self, driver: FakeDriver) -> None:
        self.driver = driver
        self.lines: list[str] = []
        self.robot = AttachedRobot("desk", driver, self.lines.append)
        self.robot.open()
        self.robot.start()


@pytest.fixture
def setup() -> Iterator[Setup]:
    """A robot that is plugged in."""
    made = Setup(FakeDriver())
    yield made
    made.robot.close()
    assert made.driver.state is DriverState.CLOSED


def forward(speed_m_s: float = 0.1) -> FloatArray:
    """Return an action that drives ahead."""
    action = np.zeros(contract.ACTION_WIDTH)
    action[[contract.WHEEL_LEFT, contract.WHEEL_RIGHT]] = speed_m_s
    action[contract.TTL] = 0.25
    return action


def test_it_moves_only_for_somebody_who_drives_it(setup: Setup) -> None:
    """An action before, or after, is none."""
    setup.robot.act(forward())
    setup.driver.readings.put(reading())
    wait_until(lambda: setup.robot.take()[0] is not None, "a reading")
    assert not setup.driver.written
    setup.robot.drive(True)
    setup.robot.act(forward())
    wait_until(lambda: setup.driver.written, "an action")
    assert setup.driver.written[-1][contract.WHEEL_LEFT] == 0.1
    setup.robot.drive(False)
    wait_until(lambda: setup.driver.state is DriverState.INACTIVE, "it stands still")


def test_an_action_is_never_repeated(setup: Setup) -> None:
    """Wheels turn for as long as somebody sends actions, and no longer."""
    setup.robot.drive(True)
    setup.robot.act(forward())
    wait_until(lambda: setup.driver.written, "an action")
    for _ in range(10):
        setup.driver.readings.put(reading())
    wait_until(setup.driver.readings.empty, "more readings")
    assert len(setup.driver.written) == 1


def test_a_held_robot_moves_for_nobody_until_it_is_released(setup: Setup) -> None:
    """However many actions come."""
    setup.robot.drive(True)
    assert setup.robot.hold()
    for _ in range(5):
        setup.robot.act(forward())
        setup.driver.readings.put(reading())
    wait_until(setup.driver.readings.empty, "readings")
    assert not setup.driver.written
    assert setup.robot.release()
    setup.robot.act(forward())
    wait_until(lambda: setup.driver.written, "an action")


def test_a_robot_that_is_lost_is_said_once_and_moves_again_for_a_new_action(setup: Setup) -> None:
    """Not for the one that waited."""
    setup.robot.drive(True)
    setup.driver.lose()
    wait_until(lambda: "desk: lost: fake: unplugged" in setup.lines, "the loss is said")
    assert not setup.robot.is_connected
    setup.driver.state = DriverState.INACTIVE
    wait_until(lambda: setup.lines[-1] == "desk: connected", "the return is said")
    assert not setup.driver.written
    setup.robot.act(forward())
    wait_until(lambda: setup.driver.written, "an action")
    assert setup.lines.count("desk: lost: fake: unplugged") == 1


def test_a_robot_whose_battery_is_critical_stands_still_until_it_is_charged(setup: Setup) -> None:
    """Whatever it is told; low is a warning, and each is said once."""
    setup.robot.drive(True)
    for is_low, is_critical in ((True, False), (True, False), (True, True)):
        setup.driver.readings.put(
            replace(reading(), is_battery_low=is_low, is_battery_critical=is_critical)
        )
    wait_until(lambda: setup.robot.is_exhausted, "the battery is critical")
    assert [line for line in setup.lines if "battery low" in line] == [
        "desk: battery low: it meets nobody until it is charged"
    ]
    setup.robot.act(forward())
    setup.driver.readings.put(replace(reading(), is_battery_critical=True))
    wait_until(setup.driver.readings.empty, "a reading")
    assert not setup.driver.written
    assert setup.robot.why_unusable() == "battery critical"
    setup.driver.readings.put(reading())
    wait_until(lambda: setup.lines[-1] == "desk: battery charged", "it is charged")
    setup.robot.act(forward())
    wait_until(lambda: setup.driver.written, "an action")


def test_a_robot_that_is_not_plugged_in_is_waited_for() -> None:
    """And one that needs a person ends the command."""
    setup = Setup(FakeDriver(is_present=False))
    assert setup.lines == ["desk: waits for it: fake: not plugged in"]
    setup.driver.is_present = True
    wait_until(lambda: setup.robot.is_connected, "it is connected")
    setup.robot.close()
    with pytest.raises(DeviceError, match="permission denied"):
        AttachedRobot("desk", BrokenDriver(), setup.lines.append).open()


def test_a_robot_that_nothing_stops_is_refused_when_it_is_plugged_in_later_too() -> None:
    """What it is shows only when it is connected."""
    driver = FakeDriver(is_present=False)
    driver.description = dataclasses.replace(driver.description, watchdog="none")
    setup = Setup(driver)
    setup.robot.drive(True)
    setup.robot.act(forward())
    driver.is_present = True
    wait_until(lambda: "nothing stops its wheels" in setup.lines[-1], "it is refused")
    assert not setup.robot.is_connected
    setup.robot.close()
    assert not driver.written
    with pytest.raises(DeviceError, match="desk: nothing stops its wheels"):
        AttachedRobot("desk", driver, setup.lines.append).open()
    AttachedRobot("desk", driver, setup.lines.append, needs_watchdog=False).open()
    assert driver.state is DriverState.INACTIVE


def test_infrared_messages_wait_for_the_control_period(setup: Setup) -> None:
    """A bounded number of them."""
    for k in range(50):
        setup.driver.readings.put(reading(0.5, bytes([k])))
    wait_until(setup.driver.readings.empty, "readings")
    heard: list[bytes] = []
    wait_until(lambda: heard.extend(setup.robot.take()[1]) or bytes([49]) in heard, "the last")  # type: ignore[func-returns-value]
    assert len(heard) <= 33


def test_its_beacon_repeats_what_is_loaded(setup: Setup) -> None:
    """The newest message."""
    setup.robot.drive(True)
    setup.robot.load_beacon(b"one")
    wait_until(lambda: setup.driver.beacons == [b"one"], "it is loaded")
