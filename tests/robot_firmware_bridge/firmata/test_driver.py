"""A robot with StandardFirmata is driven as well as that can be: the unmodified firmware on an emulated Uno."""

import re
import signal
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from crcolony_bridge.driver import DriverState
from crcolony_bridge.errors import DeviceError
from crcolony_bridge.firmata import wheels
from crcolony_bridge.firmata.board import DEFAULT_BOARD, load_board
from crcolony_bridge.firmata.driver import FirmataRobot, uid_of

from crcolony.body import contract
from tests.robot_firmware_bridge.driving import (
    any_reading,
    drive,
    drive_until,
    read_until,
    wait_for_state,
)
from tests.robot_firmware_bridge.firmata.loose_link import LooseLinks
from tests.robot_firmware_bridge.firmata.uno_robot import UnoRobot, needs_firmata
from tests.robot_firmware_bridge.noisy_link import NoisyLinks
from tests.support.command_line import refusal, run_command, start_command

STOPPED_WITHIN_S = 0.4
"""By this process, from the last command on; while it runs, and the link carries."""
NOISE_S = 3.0
TURNING = "wheels 187 -119 "
"""What `drive()` is on the motor shield, whose motors begin to turn at a fifth of full PWM"""
MOVING = "wheels (?!0 0 )"
STAND_STILL = wheels.stand_still(load_board(DEFAULT_BOARD))


def lose_stops(data: bytes) -> bytes:
    """Lose what stops the wheels, but not the questions beside it."""
    return data.replace(STAND_STILL, b"")


def keeps_turning(uno: UnoRobot, seconds: float) -> bool:
    """Return whether the wheels turn for so long, all the time."""
    since = len(uno.lines)
    time.sleep(seconds)
    return uno.wheels != (0, 0) and uno.match("wheels 0 0", since) is None


def test_a_board_that_there_is_not_is_said() -> None:
    """The motor shield is the board if none is named."""
    assert FirmataRobot("/dev/ttyACM0").description.model == load_board(DEFAULT_BOARD).model
    with pytest.raises(DeviceError, match="no board is called toaster"):
        FirmataRobot("/dev/ttyACM0?board=toaster")


def test_a_uid_is_the_name_of_the_device() -> None:
    """One by its serial number stays with the robot."""
    assert (
        uid_of("/dev/serial/by-id/usb-Arduino_0043_75-if00") == "firmata-usb-Arduino_0043_75-if00"
    )
    assert uid_of("tcp:127.0.0.1:4000") == "firmata-tcp_127.0.0.1_4000"


@needs_firmata
def test_a_robot_says_what_it_is_and_measures(uno: UnoRobot, driver: FirmataRobot) -> None:
    """Twenty times a second; above all that nothing stops it."""
    assert driver.description.model == "Arduino Uno with Motor Shield Rev3"
    assert (driver.description.watchdog, driver.description.watchdog_s) == ("none", 0.0)
    uno.set_volts(3, 0.93)
    uno.set_volts(5, 3.7)
    column = contract.PROXIMITY + 3
    reading = read_until(driver, lambda found: abs(found.row[column] - 0.3) < 0.01)
    assert reading.battery_v == pytest.approx(7.4, abs=0.02)
    first, *_, last = (read_until(driver, any_reading) for _ in range(11))
    assert last.time_s - first.time_s == pytest.approx(0.5, abs=0.25)


@needs_firmata
def test_wheels_turn_as_commanded_in_both_directions(uno: UnoRobot, driver: FirmataRobot) -> None:
    """Each of them, seen at the pins; and they are observed as the pins are set."""
    for left_m_s, right_m_s in ((0.3, -0.3), (-0.3, 0.3), (0.15, 0.0)):
        left, right = (_duty(speed_m_s) for speed_m_s in (left_m_s, right_m_s))
        drive_until(driver, uno, f"wheels {left} {right} ", drive(0.5, left_m_s, right_m_s))
        driver.write(drive(0.5, left_m_s, right_m_s))
        _observes_wheels(driver, left_m_s, right_m_s)


def _observes_wheels(driver: FirmataRobot, left_m_s: float, right_m_s: float) -> None:
    expected, at = pytest.approx([left_m_s, right_m_s], abs=0.01), contract.WHEELS
    read_until(driver, lambda found: found.row[at : at + 2].tolist() == expected)


def _duty(speed_m_s: float) -> int:
    duty = round(255 * (0.2 + 0.8 * abs(speed_m_s) / 0.3)) if speed_m_s else 0
    return duty if speed_m_s > 0 else -duty


@needs_firmata
def test_motors_with_two_pins_of_direction_turn(tmp_path: Path) -> None:
    """As an L298N has them."""
    with UnoRobot(tmp_path, board="uno_two_pins") as robot:
        driver = FirmataRobot(f"{robot.host_link}?board=uno_two_pins")
        driver.open()
        drive_until(driver, robot, "wheels 255 -166 ", drive(0.5, 0.3, -0.15))
        drive_until(driver, robot, "wheels -166 255 ", drive(0.5, -0.15, 0.3))
        driver.close()
        assert robot.wheels == (0, 0)


@needs_firmata
def test_this_process_keeps_the_time_to_live(uno: UnoRobot, driver: FirmataRobot) -> None:
    """Though nobody reads, writes, or does anything else."""
    since = len(uno.lines)
    commanded_s = time.monotonic()
    driver.write(drive(0.25))
    uno.wait_for(TURNING, since=since)
    uno.wait_for("wheels 0 0", since=since)
    assert 0.25 <= time.monotonic() - commanded_s <= STOPPED_WITHIN_S


@needs_firmata
def test_a_stop_that_was_lost_on_its_way_is_sent_again(
    uno: UnoRobot, driver: FirmataRobot, links: LooseLinks
) -> None:
    """Each reading shows whether wheels turn that should not."""
    drive_until(driver, uno, TURNING)
    links.last.lose = lose_stops
    assert keeps_turning(uno, 0.4)
    links.last.lose = lambda data: data
    read_until(driver, lambda found: not found.row[contract.WHEELS])
    assert uno.wheels == (0, 0)


@needs_firmata
def test_a_stop_is_confirmed_only_when_the_pins_read_back_as_zero(
    uno: UnoRobot, driver: FirmataRobot, links: LooseLinks
) -> None:
    """Not when it was lost, though the robot answers; the latch holds all the same."""
    drive_until(driver, uno, TURNING)
    links.last.lose = lose_stops
    assert not driver.stop()
    assert uno.wheels != (0, 0)
    links.last.lose = lambda data: data
    assert driver.stop()
    assert uno.wheels == (0, 0)
    driver.activate()
    driver.write(drive())
    assert read_until(driver, any_reading).is_stopped
    assert driver.clear()
    drive_until(driver, uno, TURNING)


@needs_firmata
def test_no_command_is_carried_out_after_a_stop(uno: UnoRobot, driver: FirmataRobot) -> None:
    """However busily another thread drives: the latch is on this side of the link."""
    for _ in range(5):
        driver.clear()
        drive_until(driver, uno, TURNING)
        stopping = ThreadPoolExecutor(1).submit(driver.stop)
        while not stopping.done():
            driver.write(drive())
            driver.read(0.001)
        driver.write(drive())
        since = len(uno.lines)
        read_until(driver, lambda found: found.is_stopped)
        assert stopping.result()
        assert uno.wheels == (0, 0)
        assert uno.match(MOVING, since) is None


@needs_firmata
def test_danger_wheels_turn_on_when_the_link_is_cut_until_somebody_connects(
    uno: UnoRobot, driver: FirmataRobot, links: LooseLinks
) -> None:
    """Nothing in the robot stops them. Who connects does so first, and is INACTIVE."""
    drive_until(driver, uno, TURNING, drive(0.5))
    links.last.close()
    assert keeps_turning(uno, 1.5)
    wait_for_state(driver, DriverState.LOST)
    wait_for_state(driver, DriverState.INACTIVE)
    driver.write(drive())
    assert not read_until(driver, any_reading).row[contract.WHEELS]
    drive_until(driver, uno, TURNING)


@needs_firmata
def test_a_robot_that_hangs_or_was_unplugged_comes_back_inactive(tmp_path: Path) -> None:
    """With its motors off."""
    with UnoRobot(tmp_path) as robot:
        driver = FirmataRobot(str(robot.host_link))
        driver.open()
        drive_until(driver, robot, TURNING)
        robot.freeze()
        assert wait_for_state(driver, DriverState.LOST) > 0.5
        assert driver.trouble == "silent for 1 s"
        robot.switch_off()
        robot.start()
        since = len(robot.lines)
        wait_for_state(driver, DriverState.INACTIVE, within_s=20.0)
        driver.write(drive())
        read_until(driver, any_reading)
        assert robot.match(MOVING, since) is None
        drive_until(driver, robot, TURNING)
        driver.close()


@needs_firmata
def test_on_a_noisy_line_wheels_do_not_keep_turning(uno: UnoRobot) -> None:
    """No CRC guards these bytes: what noise has started is stopped, and the robot can be driven afterwards."""
    noisy = NoisyLinks(0.01)
    driver = FirmataRobot(str(uno.host_link), connect=noisy.open)
    driver.open()
    noisy.set_noisy(True)
    end_s = time.monotonic() + NOISE_S
    while time.monotonic() < end_s:
        driver.activate()
        driver.write(drive())
        driver.read(0.05)
    noisy.set_noisy(False)
    time.sleep(STOPPED_WITHIN_S)
    read_until(driver, lambda found: not found.row[contract.WHEELS])
    assert uno.wheels == (0, 0)
    drive_until(driver, uno, TURNING)
    driver.close()


# The commands --------------------------------------------------------------------------------------------------------


@needs_firmata
@pytest.mark.parametrize("action", ["drive", "calibrate"])
def test_it_is_not_driven_by_hand_unless_a_person_allows_it(
    uno: UnoRobot, capsys: pytest.CaptureFixture[str], tmp_path: Path, action: str
) -> None:
    """In one line, and nothing has moved."""
    since = len(uno.lines)
    folder = tmp_path / "calibrations"
    options = ["--robot", f"firmata@{uno.host_link}", "--left", "0.1"]
    line = refusal(capsys, "bridge", action, *options, "--calibrations", folder)
    assert re.search("nothing stops its wheels when this machine dies.*--without-watchdog", line)
    assert uno.match(MOVING, since) is None
    assert not folder.exists()


@needs_firmata
def test_the_bridge_does_not_serve_it_unless_a_person_allows_it(uno: UnoRobot) -> None:
    """In one line with its name."""
    robot = f"firmata@{uno.host_link}"
    done = run_command("bridge", "--robot", robot, "--listen", "tcp/127.0.0.1:0")
    assert done.returncode == 2
    assert done.stderr == (
        f"crcolony: {robot}: nothing stops its wheels when this machine dies;"
        " if it can do no harm: --without-watchdog\n"
    )


@needs_firmata
def test_a_probe_says_so_and_moves_nothing(uno: UnoRobot) -> None:
    """Without asking for leave."""
    since = len(uno.lines)
    done = run_command("bridge", "probe", "--robot", f"firmata@{uno.host_link}")
    assert done.returncode == 0, done.stderr
    assert "watchdog    NONE: its wheels turn on if this machine dies" in done.stdout
    assert uno.match(MOVING, since) is None


@needs_firmata
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_command_that_is_ended_leaves_it_standing_still(
    uno: UnoRobot, number: signal.Signals
) -> None:
    """By SIGTERM, or by closing its terminal."""
    assert _drives(uno, number)


@needs_firmata
def test_danger_wheels_turn_on_when_the_command_is_killed(uno: UnoRobot) -> None:
    """Nobody is left to stop them."""
    assert not _drives(uno, signal.SIGKILL)
    assert keeps_turning(uno, 1.0)


def _drives(uno: UnoRobot, number: signal.Signals) -> bool:
    """Drive by a command that a signal ends; return whether the wheels stand still then."""
    since = len(uno.lines)
    options = ["--without-watchdog", "--left", "0.3", "--right", "0.3", "--seconds", "30"]
    process = start_command("bridge", "drive", "--robot", f"firmata@{uno.host_link}", *options)
    try:
        uno.wait_for("wheels 255 255", within_s=30.0, since=since)
        process.send_signal(number)
        process.communicate(timeout=10.0)
    finally:
        process.kill()
        process.communicate()
    return uno.wheels == (0, 0)
