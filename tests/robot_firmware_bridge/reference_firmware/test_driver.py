"""A robot with the reference firmware is driven over its serial line: real firmware in an emulator, real faults."""

import os
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from crcolony_bridge.driver import DriverState, Reading
from crcolony_bridge.errors import DeviceError, DeviceLostError
from crcolony_bridge.link import open_link
from crcolony_bridge.reference_firmware.driver import BAUD, SerialFirmware
from crcolony_bridge.reference_firmware.frames import FrameReader
from crcolony_bridge.reference_firmware.messages import Boot, MessageType, ResetCause

from crcolony.body import contract
from tests.robot_firmware_bridge.driving import drive, drive_until, read_until, wait_for_state
from tests.robot_firmware_bridge.emulated_robot import AvrRobot, EmulatedFirmware
from tests.robot_firmware_bridge.firmware import needs_avr, needs_cortex_m3
from tests.robot_firmware_bridge.noisy_link import NoisyLinks
from tests.robot_firmware_bridge.qemu_robot import CortexRobot
from tests.robot_firmware_bridge.rp2040_robot import Rp2040Robot, needs_rp2040

STOPPED_WITHIN_MS = 300
"""What is promised for the reference firmware, from the last command on."""


NOISE_S = 10.0
RESET_WITHIN_MS = 350
"""Of a firmware that hangs, by a watchdog of 250 ms."""
EMULATORS: dict[str, Callable[[Path], EmulatedFirmware]] = {
    "ATmega2560": AvrRobot,
    "Cortex-M3": CortexRobot,
    "RP2040": Rp2040Robot,
}


@pytest.fixture(
    params=[
        pytest.param("ATmega2560", marks=needs_avr),
        pytest.param("Cortex-M3", marks=needs_cortex_m3),
        pytest.param("RP2040", marks=needs_rp2040),
    ]
)
def emulated(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[EmulatedFirmware]:
    """A robot that is switched on, of every kind."""
    with EMULATORS[request.param](tmp_path) as robot:
        yield robot


@pytest.fixture
def driver(emulated: EmulatedFirmware) -> Iterator[SerialFirmware]:
    """A driver that is connected and active."""
    made = SerialFirmware(str(emulated.host_link))
    made.open()
    made.activate()
    yield made
    made.close()


def turns(reading: Reading) -> bool:
    return bool(np.abs(reading.row[contract.WHEELS : contract.WHEELS + 2]).max() > 0.0)


def test_a_robot_says_what_it_is_and_measures(
    emulated: EmulatedFirmware, driver: SerialFirmware
) -> None:
    """Description, battery and proximity, in SI units."""
    assert driver.description.uid == "0102030405060708"
    assert driver.description.watchdog == "firmware"
    emulated.set_proximity(1, 0.15)
    emulated.set_battery(7.2)
    reading = read_until(driver, lambda reading: reading.battery_v < 7.5)
    assert reading.battery_v == pytest.approx(7.2, abs=0.02)
    assert reading.row[contract.BATTERY] == pytest.approx((7.2 - 6.2) / (8.4 - 6.2), abs=0.02)
    # Of seven sensors the second looks to the right, of the three of the RP2040 it looks ahead.
    column = contract.PROXIMITY + (1 if len(driver.description.proximity_bearings_rad) == 7 else 3)
    reading = read_until(driver, lambda reading: bool(reading.row[column] < 0.2))
    assert reading.row[column] == pytest.approx(0.15, abs=0.005)
    assert reading.row[contract.PROXIMITY] == driver.description.proximity_range_m


def test_wheels_turn_only_while_the_driver_is_active(
    emulated: EmulatedFirmware, driver: SerialFirmware
) -> None:
    """And what is applied is returned: in a state without motion, without motion."""
    driver.deactivate()
    assert (driver.write(drive())[:2] == 0.0).all()
    driver.activate()
    assert driver.write(drive())[:2].tolist() == [0.2, -0.1]
    emulated.wait_for("wheels 200 -100")
    read_until(driver, turns)
    driver.deactivate()
    emulated.wait_for("wheels 0 0")


def test_a_robot_that_is_too_fast_keeps_its_curve(
    emulated: EmulatedFirmware, driver: SerialFirmware
) -> None:
    """Both wheels are slowed by the same factor."""
    assert driver.write(drive(0.25, 1.0, 0.5))[:2].tolist() == [0.5, 0.25]
    emulated.wait_for("wheels 500 250")


def test_without_a_fresh_command_the_wheels_stop(
    emulated: EmulatedFirmware, driver: SerialFirmware
) -> None:
    """By the firmware's own clock, whatever has become of this machine."""
    driver.write(drive(0.25))
    started = int(emulated.wait_for(r"wheels 200 -100 at (\d+)")[1])
    stopped = int(emulated.wait_for(r"wheels 0 0 at (\d+)")[1])
    assert stopped - started <= STOPPED_WITHIN_MS


def test_a_firmware_that_hangs_is_reset_and_comes_back_inactive(
    emulated: EmulatedFirmware, driver: SerialFirmware
) -> None:
    """Its motors are off within the time of the hardware watchdog, and nothing moves by itself afterwards."""
    driver.write(drive(0.5))
    emulated.wait_for("wheels 200 -100")
    emulated.hang()
    hung_ms = int(emulated.wait_for(r"hung at (\d+)")[1])
    reset_ms = int(emulated.wait_for(r"reset at (\d+)")[1])
    assert reset_ms - hung_ms <= RESET_WITHIN_MS
    stopped_ms = int(emulated.wait_for(r"wheels 0 0 at (\d+)")[1])
    assert stopped_ms - reset_ms <= 5
    wait_for_state(driver, DriverState.LOST)
    wait_for_state(driver, DriverState.INACTIVE)
    driver.write(drive())
    driver.read(0.1)
    assert emulated.wheels == (0, 0)
    drive_until(driver, emulated, "wheels 200 -100")


def test_a_cable_that_is_pulled_and_put_back(
    emulated: EmulatedFirmware, driver: SerialFirmware
) -> None:
    """LOST at once, reading and writing go on without a robot, and INACTIVE when it is back."""
    emulated.switch_off()
    wait_for_state(driver, DriverState.LOST)
    assert (driver.write(drive())[:2] == 0.0).all()
    assert driver.read(0.05) is None
    emulated.start()
    wait_for_state(driver, DriverState.INACTIVE)
    drive_until(driver, emulated, "wheels 200 -100")


def test_an_emergency_stop_is_confirmed_and_latched(
    emulated: EmulatedFirmware, driver: SerialFirmware
) -> None:
    """From another thread, while the first one reads."""
    driver.write(drive(0.5))
    emulated.wait_for("wheels 200 -100")
    confirmed: list[bool] = []
    stopping = threading.Thread(target=lambda: confirmed.append(driver.stop()))
    stopping.start()
    while stopping.is_alive():
        driver.read(0.02)
    assert confirmed == [True]
    emulated.wait_for("wheels 0 0")
    assert read_until(driver, lambda reading: reading.is_stopped)
    driver.activate()
    wait_for_state(driver, DriverState.INACTIVE, within_s=0.0)
    assert driver.clear()
    read_until(driver, lambda reading: not reading.is_stopped)
    drive_until(driver, emulated, "wheels 200 -100")


def test_a_watchdog_releases_no_stop(emulated: EmulatedFirmware, driver: SerialFirmware) -> None:
    """The latch outlives the reset of a firmware that hangs."""
    stopping = threading.Thread(target=driver.stop)
    stopping.start()
    while stopping.is_alive():
        driver.read(0.02)
    emulated.hang()
    emulated.wait_for("reset")
    wait_for_state(driver, DriverState.LOST)
    wait_for_state(driver, DriverState.INACTIVE)
    assert read_until(driver, lambda reading: True).is_stopped
    driver.activate()
    driver.write(drive())
    assert read_until(driver, lambda reading: True).is_stopped
    assert emulated.wheels == (0, 0)


def test_a_robot_says_that_its_watchdog_has_reset_it(emulated: EmulatedFirmware) -> None:
    """Without being asked, and with its uid."""
    driver = SerialFirmware(str(emulated.host_link))
    driver.open()  # it is up
    driver.close()
    link = open_link(str(emulated.host_link), BAUD)
    reader = FrameReader()
    emulated.hang()
    boots: list[Boot] = []
    end_s = time.monotonic() + 5.0
    while not boots and time.monotonic() < end_s:
        frames = reader.feed(link.read(0.1))
        boots = [Boot.parse(frame) for frame in frames if frame.type == MessageType.BOOT]
    link.close()
    assert boots == [Boot(ResetCause.WATCHDOG, bytes(range(1, 9)))]


def test_a_message_goes_out_and_comes_in_by_infrared(
    emulated: EmulatedFirmware, driver: SerialFirmware
) -> None:
    """While the beacon is on: what the infrared line of a robot sends, another one's host receives whole."""
    message = bytes(range(200))
    assert driver.send_ir(message)
    beacon = drive(0.5, 0.0, 0.0)
    beacon[contract.BEACON] = 1.0
    with emulated.ir_link.open("r+b", buffering=0) as air:
        os.set_blocking(air.fileno(), False)
        heard: tuple[bytes, ...] = ()
        end_s = time.monotonic() + 5.0
        while not heard and time.monotonic() < end_s:
            driver.write(beacon)
            air.write(air.read(4096) or b"")  # a mirror
            if (
                reading := driver.read(0.005)
            ) is not None:  # shorter than from one reading to the next
                heard = reading.ir_messages
    assert heard == (message,)


def test_noise_on_the_line_moves_nothing_and_ends_nothing(emulated: EmulatedFirmware) -> None:
    """3 % of all bytes are damaged: most frames are lost, and wheels do what they were told, or stand still."""
    links = NoisyLinks(0.03)
    driver = SerialFirmware(str(emulated.host_link), connect=links.open)
    driver.open()
    driver.activate()
    since = len(emulated.lines)
    links.set_noisy(True)
    end_s = time.monotonic() + NOISE_S
    while time.monotonic() < end_s:
        driver.write(drive(0.1))
        driver.read(0.02)
        driver.activate()
    links.set_noisy(False)
    seen = {line.partition(" at ")[0] for line in emulated.lines[since:]}
    assert seen <= {"wheels 200 -100", "wheels 0 0"}
    read_until(driver, lambda reading: True)  # connected, again if it was lost
    drive_until(driver, emulated, "wheels 200 -100")
    driver.close()


def test_a_second_controller_is_refused(emulated: EmulatedFirmware, driver: SerialFirmware) -> None:
    """The device is ours alone, and so is the robot."""
    with pytest.raises(DeviceError, match="another program uses it"):
        SerialFirmware(str(emulated.host_link)).open()


def test_a_critical_battery_stops_the_robot(
    emulated: EmulatedFirmware, driver: SerialFirmware
) -> None:
    """It says so, and moves again when it is charged."""
    emulated.set_battery(6.0)
    assert read_until(driver, lambda reading: reading.is_battery_critical).is_battery_low
    driver.write(drive())
    driver.read(0.1)
    assert emulated.wheels == (0, 0)
    emulated.set_battery(7.6)
    read_until(driver, lambda reading: not reading.is_battery_critical)
    driver.write(drive())
    emulated.wait_for("wheels 200 -100")


def test_a_robot_that_is_not_the_expected_one_is_refused(emulated: EmulatedFirmware) -> None:
    """By its uid."""
    with pytest.raises(DeviceError, match="robot 0102030405060708 is there, not ffff"):
        SerialFirmware(str(emulated.host_link), uid="ffff").open()


def test_a_wrong_baud_rate_or_another_device_is_said(tmp_path: Path) -> None:
    """A terminal where nobody answers; what is no device; what is not there."""
    leader, follower = os.openpty()
    with pytest.raises(DeviceError, match="check the baud rate, and which firmware"):
        SerialFirmware(os.ttyname(follower)).open()
    os.close(leader)
    os.close(follower)
    (tmp_path / "file").touch()
    with pytest.raises(DeviceError, match="not a serial device"):
        SerialFirmware(str(tmp_path / "file")).open()
    with pytest.raises(DeviceLostError, match="there is no such device"):
        SerialFirmware(str(tmp_path / "missing")).open()
