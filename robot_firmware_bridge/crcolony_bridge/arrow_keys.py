"""Driving a robot with the arrow keys of a terminal: it stops when no key has been pressed for a while."""

import contextlib
import os
import select
import sys
import termios
import time
import tty
from collections.abc import Callable, Iterator

from crcolony_bridge.bench import PERIOD_S, motion, opened
from crcolony_bridge.driver import Driver
from crcolony_bridge.driver_body import DriverBody
from crcolony_bridge.errors import DeviceError

_HOLD_S = 0.5
"""A key counts for so long: terminals repeat a key that is held only after a while."""
_QUIT_KEY = b"q"
_DIRECTIONS = {
    b"\x1b[A": (1.0, 1.0),
    b"\x1b[B": (-1.0, -1.0),
    b"\x1b[C": (1.0, -1.0),
    b"\x1b[D": (-1.0, 1.0),
}
"""How the wheels turn, left and right, for up, down, right and left."""


def drive_with_keys(
    driver: Driver,
    speed_m_s: float,
    print_line: Callable[[str], None],
    *,
    needs_watchdog: bool = True,
) -> None:
    """Drive until q is pressed; the space bar stops. Raises DeviceError without a terminal, or if the robot is lost."""
    if not sys.stdin.isatty():
        raise DeviceError("drive: arrow keys need a terminal; or give --left and --right")
    opening = opened(driver, needs_watchdog=needs_watchdog)
    with opening, _raw(sys.stdin.fileno()) as terminal:
        body = DriverBody(driver, PERIOD_S)
        print_line("arrow keys drive, space stops, q ends\r")
        wheels, until_s = (0.0, 0.0), 0.0
        while (key := _pressed(terminal)) != _QUIT_KEY:
            now_s = time.monotonic()
            if key:
                wheels, until_s = _DIRECTIONS.get(key, (0.0, 0.0)), now_s + _HOLD_S
            elif now_s >= until_s:
                wheels = 0.0, 0.0
            body.act(motion(wheels[0] * speed_m_s, wheels[1] * speed_m_s))
            body.read()


def _pressed(terminal: int) -> bytes:
    """Return the key that was pressed last, nothing if there was none."""
    keys = b""
    while select.select([terminal], [], [], 0.0)[0]:
        data = os.read(terminal, 64)
        if not data:
            return _QUIT_KEY
        keys = data
    last = keys[-3:] if keys[-3:] in _DIRECTIONS else keys[-1:]
    return _QUIT_KEY if last in (b"\x03", b"\x04") else last


@contextlib.contextmanager
def _raw(terminal: int) -> Iterator[int]:
    """Receive keys at once inside the context, without their echo."""
    before = termios.tcgetattr(terminal)
    tty.setraw(terminal)
    try:
        yield terminal
    finally:
        termios.tcsetattr(terminal, termios.TCSADRAIN, before)
