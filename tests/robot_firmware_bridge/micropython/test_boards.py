"""Boards with a USB console: the script is uploaded to MicroPython itself, and drives the pins of their makers' plans.

Pins and directions are those of the libraries of Pololu and of SparkFun; no such board was attached by us.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from crcolony_bridge.driver import DriverState
from crcolony_bridge.micropython.driver import MicroPythonRobot

from crcolony.body import contract
from tests.robot_firmware_bridge.driving import drive, read_until, wait_for_state
from tests.robot_firmware_bridge.micropython.usb_board import UsbBoard, needs_micropython
from tests.support.process import wait_until

XRP_PINS = tuple(f"MOTOR_{side}_IN_{k}" for side in "LR" for k in (1, 2))
STOPPED_WITHIN_MS = 400


@contextmanager
def driven(board: UsbBoard, name: str) -> Iterator[MicroPythonRobot]:
    """A driver of a board that is connected and active."""
    driver = MicroPythonRobot(f"{board.host_link}?board={name}")
    driver.open()
    driver.activate()
    try:
        yield driver
    finally:
        driver.close()


def shows(board: UsbBoard, **levels: int) -> Callable[[], bool]:
    """Return whether pins are set so; `pwm_15` is the PWM of pin 15."""
    named = [(key.partition("_"), level) for key, level in levels.items()]
    return lambda: all(board.level(kind, pin) == level for (kind, _, pin), level in named)


@needs_micropython
def test_a_3pi_drives_measures_its_battery_and_stops(tmp_path: Path) -> None:
    """Full duty is 1.5 m/s; a direction pin is high to drive back; the time to live is the script's."""
    with UsbBoard(tmp_path) as board, driven(board, "pololu_3pi_2040") as driver:
        assert driver.description.model == "Pololu 3pi+ 2040"
        assert driver.description.watchdog == "uploaded program"
        since = len(board.lines)
        driver.write(drive(0.25, 0.3, -0.15))
        started_ms = int(board.wait_for(r"pwm 15 13107 at (\d+)", since=since)[1])
        stopped_ms = int(board.wait_for(r"pwm 15 0 at (\d+)", since=since)[1])
        assert stopped_ms - started_ms <= STOPPED_WITHIN_MS
        assert any(line.startswith("pin 10 1") for line in board.lines)
        assert any(line.startswith("pwm 14 6553") for line in board.lines)
        wait_until(shows(board, pwm_15=0, pwm_14=0), "both wheels stand still")
        board.tell("adc 8500")
        reading = read_until(driver, lambda reading: reading.battery_v < 5.0)
        assert reading.battery_v == pytest.approx(4.708, abs=0.01)
        board.tell("adc 7900")
        assert read_until(driver, lambda reading: reading.is_battery_critical).is_battery_low
        driver.write(drive(0.5, 0.3, 0.3))
        read_until(driver, lambda reading: True)
        assert shows(board, pwm_15=0, pwm_14=0)()


@needs_micropython
def test_a_stop_is_latched_on_a_board_with_a_usb_console(tmp_path: Path) -> None:
    """A driver that connects again finds the script running, and stopped."""
    with UsbBoard(tmp_path) as board:
        with driven(board, "pololu_3pi_2040") as driver:
            assert driver.stop()
        with driven(board, "pololu_3pi_2040") as driver:
            assert read_until(driver, lambda reading: True).is_stopped
            driver.write(drive())
            assert read_until(driver, lambda reading: True).is_stopped
            assert driver.clear()
            driver.activate()
            driver.write(drive(0.5, 0.3, 0.3))
            wait_until(shows(board, pwm_15=13107), "it drives")


@needs_micropython
@pytest.mark.parametrize("is_beta", [False, True])
def test_an_xrp_drives_either_kind_of_motors(tmp_path: Path, is_beta: bool) -> None:
    """Today's has two PWMs a motor, the beta a direction and a PWM; the left motor is mounted the other way round."""
    names = XRP_PINS if is_beta else (*XRP_PINS, "BOARD_NEOPIXEL")
    with UsbBoard(tmp_path, *names) as board, driven(board, "xrp") as driver:
        for left, right in ((0.3, 0.15), (-0.3, -0.15)):
            driver.write(drive(0.5, left, right))
            if is_beta:
                direction = int(left > 0)
                levels = {"pin_MOTOR_L_IN_1": direction, "pin_MOTOR_R_IN_1": 1 - direction}
                levels |= {"pwm_MOTOR_L_IN_2": 32767, "pwm_MOTOR_R_IN_2": 16383}
            elif left > 0:
                levels = {"pwm_MOTOR_L_IN_1": 32767, "pwm_MOTOR_L_IN_2": 0}
                levels |= {"pwm_MOTOR_R_IN_1": 0, "pwm_MOTOR_R_IN_2": 16383}
            else:
                levels = {"pwm_MOTOR_L_IN_1": 0, "pwm_MOTOR_L_IN_2": 32767}
                levels |= {"pwm_MOTOR_R_IN_1": 16383, "pwm_MOTOR_R_IN_2": 0}
            wait_until(shows(board, **levels), "it drives", 5.0)


@needs_micropython
def test_an_xrp_sees_what_is_ahead(tmp_path: Path) -> None:
    """By the echo of its rangefinder; without one, or from afar, it sees nothing."""
    ahead = contract.PROXIMITY + 3
    with UsbBoard(tmp_path, *XRP_PINS) as board, driven(board, "xrp") as driver:
        assert read_until(driver, lambda reading: True).row[ahead] == 0.5
        board.tell("echo 1000")
        reading = read_until(driver, lambda reading: bool(reading.row[ahead] < 0.5))
        assert reading.row[ahead] == pytest.approx(0.171)
        board.tell("echo 5000")
        read_until(driver, lambda reading: bool(reading.row[ahead] == 0.5))


@needs_micropython
def test_a_board_that_was_switched_off_gets_the_script_again(tmp_path: Path) -> None:
    """It is INACTIVE when it is back."""
    with UsbBoard(tmp_path) as board, driven(board, "pololu_3pi_2040") as driver:
        board.switch_off()
        wait_for_state(driver, DriverState.LOST)
        board.start()
        wait_for_state(driver, DriverState.INACTIVE, within_s=20.0)
