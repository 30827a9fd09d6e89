"""Robots that run Aseba, Thymio II and e-puck: over a serial line, or over TCP to a simulator or `asebaswitch`.

Their firmware stops no wheels by itself, and anybody who is connected may command it. Therefore a program of ours
stops them (`program.py`), it runs before the first command, and a robot on which it runs no more is LOST.

An e-puck with this firmware has no infrared. That of a Thymio II carries words (`prox.comm`), by which robots prove
that they are near. No simulator that runs here does: it was tested as bytecode and messages, never on a robot.
"""

import time
from collections.abc import Callable

from crcolony.body import contract
from crcolony.compiled import FloatArray
from crcolony_bridge.aseba.session import AsebaSession
from crcolony_bridge.driver import DriverState, Reading, RobotDescription, limited_action
from crcolony_bridge.errors import DeviceLostError
from crcolony_bridge.infrared.short_beacon import WORD_BYTES, WORD_LIMIT
from crcolony_bridge.link import Link, open_link
from crcolony_bridge.reconnecting_driver import ReconnectingDriver

BAUD = 115_200
"""Of a real serial line; it does not matter over USB."""
MAX_TTL_S = 0.5
CONTENDED_RETRY_S = (1.0, 3.0, 10.0, 30.0)
"""Before connecting again after a connection has been lost, the first time, and each time after it.

The first one is longer than a handshake: two of us would break off each other's otherwise."""
_PEACE_S = 30.0
"""A connection that has lasted for so long was not taken over at once."""
_WITHOUT = [contract.JAW, contract.SPEAKER]
"""What these robots do not have"""


class AsebaRobot(ReconnectingDriver):
    """A robot that runs Aseba. `uid` is the one that is expected there, as in `e-puck-1`, "" for the only one."""

    silent_after_s = 1.0

    def __init__(
        self,
        address: str,
        uid: str = "",
        baud: int = BAUD,
        connect: Callable[[str, int], Link] = open_link,
    ) -> None:
        super().__init__(RobotDescription("Aseba robot", uid))
        self._address, self._uid, self._baud, self._open_link = address, uid, baud, connect
        self._session: AsebaSession | None = None
        self._is_linked = False
        """Whether a link was open since the last loss"""
        self._linked_s = 0.0
        self._takeovers = 0
        self._word: int | None = None
        """What the beacon repeats while it is on"""
        self._is_beacon_on = False

    def write(self, action: FloatArray) -> FloatArray:
        """See `Driver`."""
        may_move = self._state is DriverState.ACTIVE
        applied = limited_action(action, self._description, MAX_TTL_S, may_move=may_move)
        applied[_WITHOUT] = 0.0
        has_words = self._session is not None and self._session.has_words
        if not has_words:
            applied[contract.BEACON] = 0.0
        red, green, blue = applied[contract.LED : contract.LED + 3].tolist()
        left, right = float(applied[contract.WHEEL_LEFT]), float(applied[contract.WHEEL_RIGHT])
        ttl_s = float(applied[contract.TTL])
        try:
            if self._session is not None:
                self._session.command((left, right), (red, green, blue), ttl_s)
        except DeviceLostError as error:
            self._lose(error)
        self._switch_beacon(bool(applied[contract.BEACON] > 0.5))
        return applied

    def send_ir(self, message: bytes) -> bool:
        """See `Driver`."""
        word = int.from_bytes(message, "big")
        if len(message) != WORD_BYTES or word >= WORD_LIMIT:
            return False
        self._word = word
        return self._send_word(word) if self._is_beacon_on else self._description.ir == "tokens"

    def _connect(self) -> None:
        """Connect, and have the robot run our program."""
        session = AsebaSession(self._open_link(self._address, self._baud), self._address)
        self._session = session
        self._is_linked, self._linked_s = True, time.monotonic()
        session.start(self._uid, self._is_held)
        self._uid, self._description = session.uid, describe(session)
        self._is_beacon_on = False  # the program has just begun

    def _disconnect(self) -> None:
        session, self._session = self._session, None
        if session is not None:
            session.close()

    def _read(self, timeout_s: float) -> Reading | None:
        session = self._session
        found = session.read(timeout_s) if session is not None else None
        if session is None or found is None:
            return None
        row, is_low = session.senses.observe(found.words)
        words = [word for word in session.take_words() if 0 <= word < WORD_LIMIT]
        return Reading(
            session.clock.time_s,
            row,
            is_battery_low=is_low,
            is_stopped=found.is_stopped,
            ir_messages=tuple(word.to_bytes(WORD_BYTES, "big") for word in words),
        )

    def _stand_still(self) -> None:
        if self._session is not None:
            self._session.command((0.0, 0.0), (0.0, 0.0, 0.0), 0.0)
        self._switch_beacon(False)

    def _switch_beacon(self, is_on: bool) -> None:
        if is_on != self._is_beacon_on:
            self._is_beacon_on = is_on
            self._send_word(self._word if is_on else None)

    def _send_word(self, word: int | None) -> bool:
        """Let the robot repeat a word, or nothing; return whether it has infrared that does."""
        session = self._session
        if session is None or not session.has_words:
            return False
        try:
            session.send_word(word)
        except DeviceLostError as error:
            self._lose(error)
            return False
        return True

    def _send_stop(self) -> None:
        if self._session is not None:
            self._session.stop()

    def _send_clear(self) -> None:
        if self._session is not None:
            self._session.clear()

    def _pause_s(self) -> float:
        """Let a while pass after a connection was lost, and longer if that happens again and again.

        Over TCP the last client wins, and the one before it is dropped. Who connects again drops the other one in turn:
        two of us must not do that to each other all the time.
        """
        if not self._is_linked:
            return super()._pause_s()
        self._is_linked = False
        if time.monotonic() - self._linked_s > _PEACE_S:
            self._takeovers = 0
        self._takeovers += 1
        return CONTENDED_RETRY_S[min(self._takeovers, len(CONTENDED_RETRY_S)) - 1]


def describe(session: AsebaSession) -> RobotDescription:
    """Return the description of the robot of a session."""
    model = session.model
    return RobotDescription(
        model=model.name,
        uid=session.uid,
        is_uid_unique=False,
        track_m=model.track_m,
        radius_m=model.radius_m,
        max_speed_m_s=model.max_speed_m_s,
        proximity_bearings_rad=model.proximity.bearings_rad,
        proximity_range_m=model.proximity.range_m,
        watchdog_s=MAX_TTL_S + 2 * session.clock.tick_s,
        watchdog="uploaded program",
        ir="tokens" if session.has_words else "none",
        max_ir_bytes=WORD_BYTES if session.has_words else 0,
        period_s=session.clock.period_s,
    )
