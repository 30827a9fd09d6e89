"""Robots with StandardFirmata, over a serial line or TCP: `/dev/ttyACM0?board=FILE.toml`.

NOTHING STOPS THE WHEELS OF SUCH A ROBOT WHEN THIS MACHINE IS GONE. Firmata has no dead-man switch: what was written to
a pin stays there until something else is written, or the board is reset. Therefore its `watchdog` is "none".

What this process does instead: a thread of its own stops the wheels when the time to live is over (`WheelTimer`), also
if whoever drives hangs. Every reading asks for what the motors' pins are set to, and wheels that turn without a command
that is alive are stopped again. An emergency stop is confirmed when the pins read back as 0, `close` waits for that,
too, and who connects resets all pins first. What it cannot do: stop wheels when this process is killed or frozen, the
machine loses its power, or the cable is pulled. The latch of the emergency stop is this driver's, and gone with it.

Read back is what the firmware has its pins set to, which no motor has measured.
"""

import re
import threading
import time
from collections.abc import Callable
from contextlib import suppress

from crcolony.body import contract
from crcolony.compiled import FloatArray
from crcolony_bridge.device_address import parse_address
from crcolony_bridge.driver import DriverState, Reading, limited_action
from crcolony_bridge.errors import DeviceLostError
from crcolony_bridge.firmata.board import DEFAULT_BOARD, load_board
from crcolony_bridge.firmata.senses import reading_of
from crcolony_bridge.firmata.session import PERIOD_S, FirmataSession
from crcolony_bridge.firmata.wheel_timer import WheelTimer
from crcolony_bridge.link import Link, open_link
from crcolony_bridge.reconnecting_driver import ReconnectingDriver

MAX_TTL_S = 0.5
_OUTPUTS = slice(contract.JAW, contract.BEACON + 1)
"""What these robots do not have: jaw, lamp, speaker and beacon"""


class FirmataRobot(ReconnectingDriver):
    """A robot with StandardFirmata that is wired as a board says, the one of the motor shield if none is named.

    Its uid is the name of its device: one under `/dev/serial/by-id` stays with the robot.
    """

    silent_after_s = 1.0
    """Longer than the longest time to live: the wheels have been stopped before the link is given up."""

    def __init__(self, address: str, connect: Callable[[str, int], Link] = open_link) -> None:
        self._address, board = parse_address(address, DEFAULT_BOARD)
        self._board = load_board(board)
        super().__init__(self._board.describe(uid_of(self._address), PERIOD_S))
        self._open_link = connect
        self._session: FirmataSession | None = None
        self._mutex = threading.RLock()
        """Held while wheels are commanded, so that none is after an emergency stop"""
        self._timer = WheelTimer(self._mutex, self._stop_quietly)
        self._is_latched = False
        self._started_s = time.monotonic()
        """The robot has no clock that can be read"""

    def write(self, action: FloatArray) -> FloatArray:
        """See `Driver`."""
        with self._mutex:
            may_move = self._state is DriverState.ACTIVE and not self._is_latched
            applied = limited_action(action, self._description, MAX_TTL_S, may_move=may_move)
            applied[_OUTPUTS] = 0.0
            left, right = float(applied[contract.WHEEL_LEFT]), float(applied[contract.WHEEL_RIGHT])
            ttl_s = float(applied[contract.TTL])
            try:
                if ttl_s == 0.0 or left == right == 0.0:
                    self._stand_still()
                elif self._session is not None:
                    self._timer.start(ttl_s)  # first: what is half written turns wheels, too
                    self._session.turn(left, right)
            except DeviceLostError as error:
                self._lose(error)
        return applied

    def send_ir(self, message: bytes) -> bool:
        """See `Driver`."""
        return False

    def close(self) -> None:
        """See `Driver`. Waits until the pins read back as 0, for nobody can stop these wheels afterwards."""
        if self._is_connected and self._session is not None:
            with suppress(DeviceLostError):
                self._session.halt()
        super().close()

    def _connect(self) -> None:
        """Connect, and stop whatever turns before anything else."""
        self._session = FirmataSession(
            self._open_link(self._address, self._board.baud), self._address, self._board
        )
        self._session.start()

    def _disconnect(self) -> None:
        session, self._session = self._session, None
        if session is not None:
            session.close()

    def _read(self, timeout_s: float) -> Reading | None:
        session = self._session
        found = session.read(timeout_s) if session is not None else None
        if session is None or found is None:
            return None
        with self._mutex:
            if not (found.are_still or self._timer.is_running):
                session.stand_still()  # what was written before has been lost on its way
            is_stopped = self._is_latched and found.is_after_stop and found.are_still
        return reading_of(
            self._board,
            self._description,
            session.values,
            found.wheels_m_s,
            time.monotonic() - self._started_s,
            is_stopped=is_stopped,
        )

    def _stand_still(self) -> None:
        with self._mutex:
            self._timer.end()
            if self._session is not None:
                self._session.stand_still()

    def _send_stop(self) -> None:
        with self._mutex:
            self._is_latched = True
            self._timer.end()
            if self._session is not None:
                self._session.stop_and_ask()

    def _send_clear(self) -> None:
        """Release the latch, which is nowhere but here."""
        with self._mutex:
            self._is_latched = False

    def _stop_quietly(self) -> None:
        """Stop the wheels on the timer's thread; of a link that is gone the reading thread will say so."""
        session = self._session
        with suppress(DeviceLostError):
            if session is not None:
                session.stand_still()


def uid_of(place: str) -> str:
    """Return the uid of the robot at a device or TCP address."""
    return "firmata-" + re.sub(r"[^A-Za-z0-9_.-]", "_", place.rpartition("/")[2])
