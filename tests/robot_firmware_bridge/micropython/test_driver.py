"""A robot with MicroPython is driven by a script that is uploaded to it: the firmware that Debian ships, emulated."""

import os
import threading
from collections.abc import Iterator

import pytest
from crcolony_bridge.driver import DriverState
from crcolony_bridge.errors import DeviceError
from crcolony_bridge.link import Link, open_link
from crcolony_bridge.micropython.driver import MicroPythonRobot

from crcolony.body import contract
from tests.robot_firmware_bridge.driving import (
    any_reading,
    drive,
    drive_until,
    read_until,
    wait_for_state,
)
from tests.robot_firmware_bridge.micropython.microbit_robot import (
    MicrobitRobot,
    needs_microbit,
)

STOPPED_WITHIN_MS = 400
"""What is promised for the script, from the last command on: its loop is slower than the reference firmware's."""


@pytest.fixture(scope="module")
def microbit(tmp_path_factory: pytest.TempPathFactory) -> Iterator[MicrobitRobot]:
    """A micro:bit that is switched on; the script stays on it from test to test."""
    with MicrobitRobot(tmp_path_factory.mktemp("microbit")) as robot:
        yield robot


@pytest.fixture(scope="module")
def links() -> list[Link]:
    """What the driver has opened."""
    return []


@pytest.fixture(scope="module")
def controller(microbit: MicrobitRobot, links: list[Link]) -> MicroPythonRobot:
    """The one driver of all tests: another one would have to wait until the robot gives this one up."""

    def connect(address: str, baud: int) -> Link:
        links.append(open_link(address, baud))
        return links[-1]

    return MicroPythonRobot(str(microbit.host_link), connect=connect)


@pytest.fixture
def driver(controller: MicroPythonRobot) -> Iterator[MicroPythonRobot]:
    """A driver that is connected and active."""
    controller.open()
    assert controller.clear()
    controller.activate()
    yield controller
    controller.close()


def stop_while_reading(driver: MicroPythonRobot) -> bool:
    confirmed: list[bool] = []
    stopping = threading.Thread(target=lambda: confirmed.append(driver.stop()))
    stopping.start()
    while stopping.is_alive():
        driver.read(0.02)
    return confirmed[0]


@needs_microbit
def test_a_robot_says_what_it_is_and_measures(driver: MicroPythonRobot) -> None:
    """With the uid of its chip; ten times a second."""
    assert driver.description.model == "micro:bit with two motors"
    assert driver.description.uid == "0300000078563412"
    assert driver.description.watchdog == "uploaded program"
    first, *_, last = (read_until(driver, any_reading) for _ in range(6))
    assert last.time_s - first.time_s == pytest.approx(0.5, abs=0.2)
    assert last.row[contract.PROXIMITY : contract.PROXIMITY + 2].tolist() == [0.1, 0.1]


@needs_microbit
def test_wheels_turn_only_while_the_driver_is_active(
    microbit: MicrobitRobot, driver: MicroPythonRobot
) -> None:
    """Each in its direction."""
    driver.deactivate()
    driver.write(drive())
    read_until(driver, any_reading)
    assert microbit.wheels == (0, 0)
    driver.activate()
    for left, right in ((0.2, -0.1), (-0.1, 0.2), (0.1, 0.0)):
        drive_until(
            driver, microbit, f"wheels {sign(left)} {sign(right)} ", drive(0.5, left, right)
        )


def sign(speed_m_s: float) -> int:
    return (speed_m_s > 0) - (speed_m_s < 0)


@needs_microbit
def test_wheels_stop_when_this_machine_is_gone(
    microbit: MicrobitRobot, driver: MicroPythonRobot, links: list[Link]
) -> None:
    """Nothing is sent any more, and the line is closed: the script stops the motors by its own clock."""
    before = len(microbit.lines)
    driver.write(drive(0.25))
    commanded_ms = microbit.now_ms()
    microbit.wait_for("wheels 1 -1", since=before)
    links[-1].close()
    stopped_ms = int(microbit.wait_for(r"wheels 0 0 at (\d+)", since=before)[1])
    assert 200 <= stopped_ms - commanded_ms <= STOPPED_WITHIN_MS


@needs_microbit
def test_an_emergency_stop_outlives_the_controller(
    microbit: MicrobitRobot, driver: MicroPythonRobot
) -> None:
    """A driver that connects anew finds the script running and the robot stopped; only `clear` releases it."""
    drive_until(driver, microbit, "wheels 1 -1", drive(0.5))
    assert stop_while_reading(driver)
    microbit.wait_for("wheels 0 0", since=len(microbit.lines) - 1)
    driver.close()
    driver.open()
    assert read_until(driver, any_reading).is_stopped
    driver.activate()
    driver.write(drive())
    assert read_until(driver, any_reading).is_stopped
    assert microbit.wheels == (0, 0)
    assert driver.clear()
    assert not read_until(driver, any_reading).is_stopped
    drive_until(driver, microbit, "wheels 1 -1")


@needs_microbit
def test_a_robot_that_was_switched_off_gets_the_script_again(
    microbit: MicrobitRobot, driver: MicroPythonRobot
) -> None:
    """It is INACTIVE when it is back."""
    microbit.switch_off()
    wait_for_state(driver, DriverState.LOST)
    microbit.start()
    wait_for_state(driver, DriverState.INACTIVE, within_s=20.0)
    drive_until(driver, microbit, "wheels 1 -1")


def test_a_device_without_micropython_is_said() -> None:
    """And a board that there is not."""
    leader, follower = os.openpty()
    path = os.ttyname(follower)
    with pytest.raises(DeviceError, match="no MicroPython answers; check the baud rate"):
        MicroPythonRobot(path).open()
    with pytest.raises(DeviceError, match=r"no board 'toaster'; there is microbit"):
        MicroPythonRobot(f"{path}?board=toaster")
    os.close(leader)
    os.close(follower)
