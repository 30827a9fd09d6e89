"""A person drives a robot with arrow keys, and it stops when no key comes any more."""

import sys
from pathlib import Path

import pexpect
import pytest

from tests.robot_firmware_bridge.emulated_robot import AvrRobot
from tests.robot_firmware_bridge.firmware import needs_avr
from tests.support.process_colony import crcolony

UP, LEFT = "\x1b[A", "\x1b[D"


@needs_avr
def test_arrow_keys_drive_and_letting_go_stops(tmp_path: Path) -> None:
    """With the watchdog on: the last action ends by itself."""
    with AvrRobot(tmp_path) as robot:
        command, *options = crcolony(
            "bridge", "drive", "--robot", f"firmware@{robot.host_link}", "--speed", "0.1"
        )
        person = pexpect.spawn(command, options, timeout=20)
        person.expect("arrow keys drive")
        since = len(robot.lines)
        person.send(UP)
        robot.wait_for("wheels 100 100", since=since)
        robot.wait_for("wheels 0 0", since=since)
        person.send(LEFT)
        robot.wait_for("wheels -100 100", since=since)
        person.send(" ")
        robot.wait_for("wheels 0 0", since=len(robot.lines) - 1)
        person.send("q")
        person.expect(pexpect.EOF)
        person.close()
        assert person.exitstatus == 0


def test_without_a_terminal_it_is_said(capfd: pytest.CaptureFixture[str]) -> None:
    """And what to do instead."""
    from crcolony_bridge.arrow_keys import drive_with_keys
    from crcolony_bridge.errors import DeviceError

    from tests.robot_firmware_bridge.fake_driver import FakeDriver

    assert not sys.stdin.isatty()
    with pytest.raises(DeviceError, match="--left and --right"):
        drive_with_keys(FakeDriver(), 0.1, print)
