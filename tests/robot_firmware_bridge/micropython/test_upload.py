"""The script gets onto a controller whatever runs there, and what hinders it is said in one line."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from crcolony_bridge.errors import DeviceError
from crcolony_bridge.link import Link, open_link
from crcolony_bridge.micropython import upload as upload_module
from crcolony_bridge.micropython.driver import BAUD
from crcolony_bridge.micropython.upload import is_running, upload

from tests.robot_firmware_bridge.micropython.microbit_robot import (
    MicrobitRobot,
    needs_microbit,
)


@contextmanager
def linked(robot: MicrobitRobot) -> Iterator[Link]:
    """Open the line to a robot without a driver."""
    link = open_link(str(robot.host_link), BAUD)
    try:
        yield link
    finally:
        link.close()


@needs_microbit
def test_a_program_that_runs_on_the_robot_is_ended(tmp_path: Path) -> None:
    """Whatever was on it before."""
    with MicrobitRobot(tmp_path) as robot, linked(robot) as link:
        upload_module._enter_raw_mode(link, "here")
        upload_module._send(link, b"while True: print('busy')")
        assert not is_running(link)
        upload(link, "microbit", "here")
        assert is_running(link)


@needs_microbit
def test_what_micropython_refuses_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In its own words, as one line."""
    monkeypatch.setattr(upload_module, "statements", lambda paths, kept: [b"import wheels"])
    with MicrobitRobot(tmp_path) as robot, linked(robot) as link:
        expected = r"^here: MicroPython refuses the script: ImportError: no module named 'wheels'$"
        with pytest.raises(DeviceError, match=expected):
            upload(link, "microbit", "here")
        monkeypatch.setattr(upload_module, "statements", lambda paths, kept: [])
        with pytest.raises(DeviceError, match=r"^here: the script does not start: NameError: "):
            upload(link, "microbit", "here")
