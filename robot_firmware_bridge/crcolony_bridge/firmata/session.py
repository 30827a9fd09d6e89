"""A connection to StandardFirmata: whether it is that and fits the board, and what its pins are set to, read back."""

import threading
import time
from dataclasses import dataclass
from typing import TypeVar

from crcolony_bridge.errors import DeviceError, DeviceLostError
from crcolony_bridge.firmata import protocol, wheels
from crcolony_bridge.firmata.board import Board, Motor
from crcolony_bridge.firmata.protocol import (
    AnalogMapping,
    AnalogValue,
    Capabilities,
    FirmataReader,
    Firmware,
    Message,
    PinMode,
    PinState,
    Version,
)
from crcolony_bridge.link import Link

PERIOD_S = 0.05
"""Between two rounds of questions about the motors' pins."""
STARTS_WITHIN_S = 6.0
"""An Uno is reset when its port is opened: its bootloader waits for a second, and its firmware blinks for two."""
_ASK_EVERY_S, _QUESTIONS = 0.5, 3
_CONFIRMS_WITHIN_S, _STOP_TRIES = 0.1, 5
_SAMPLING_MS = 20
_RESET = protocol.END_SYSEX + protocol.SYSTEM_RESET
"""What a host that died has left half written ends first."""
_MARKER_PIN = 0
"""Of the serial line. It is asked for after a stop and never else: what was answered just before it is younger."""

M = TypeVar("M", bound=Message)


@dataclass(frozen=True)
class Readout:
    """What the firmware has its pins set to and has measured."""

    wheels_m_s: tuple[float, float]
    are_still: bool
    """Whether neither motor has any PWM"""
    is_after_stop: bool
    """Whether this was asked for together with the newest stop, or later"""


class FirmataSession:
    """The link to one robot. One thread reads; any may write wheels."""

    def __init__(self, link: Link, address: str, board: Board) -> None:
        self._link, self._address, self._board = link, address, board
        self._reader = FirmataReader()
        self._writing = threading.Lock()
        self._round: list[PinState] = []
        """Answers about the motors' pins, in their order, of which the last one may not be complete"""
        self._asked_s = 0.0
        self._is_after_stop = False
        self.values: dict[int, int] = {}
        """What every analog channel has measured last"""

    def start(self) -> None:
        """Stop the robot, whatever it was doing, find out whether it fits the board, and set it up.

        Raises DeviceError for what is not StandardFirmata, or is wired as the board says it cannot be.
        """
        self._send(_RESET)
        self._greet()
        self._send(_RESET)  # again: bytes are lost while the firmware starts
        self._check_version()
        self._check_board()
        self._send(wheels.set_modes(self._board))
        channels = b"".join(map(protocol.report_analog, self._board.channels))
        self._send(protocol.sampling_interval(_SAMPLING_MS) + channels)
        if not self.halt():
            raise DeviceLostError(f"{self._address}: does not confirm that its wheels stand still")

    def turn(self, left_m_s: float, right_m_s: float) -> None:
        """Let the wheels turn. They do so until something else is written: nothing in the robot stops them."""
        self._send(wheels.turn(self._board, left_m_s, right_m_s))

    def stand_still(self) -> None:
        """Stop the wheels."""
        self._send(wheels.stand_still(self._board))

    def stop_and_ask(self) -> None:
        """Stop the wheels, and ask for what the pins are set to then; a readout is after the stop from then on."""
        self._is_after_stop = False
        question = self._question + protocol.query_pin(_MARKER_PIN)
        self._send(wheels.stand_still(self._board) + question)

    def halt(self) -> bool:
        """Stop the wheels, and return whether the firmware says soon that it has."""
        for _ in range(_STOP_TRIES):
            self.stop_and_ask()
            end_s = time.monotonic() + _CONFIRMS_WITHIN_S
            while (left_s := end_s - time.monotonic()) > 0.0:
                found = self.read(left_s)
                if found is not None and found.is_after_stop and found.are_still:
                    return True
        return False

    def read(self, timeout_s: float) -> Readout | None:
        """Ask when it is time, and wait for answers for so long; None after a time-out.

        Raises DeviceLostError when the robot was reset, for its pins are nobody's then.
        """
        end_s, newest = time.monotonic() + timeout_s, None
        while newest is None:
            now_s = time.monotonic()
            if now_s >= self._asked_s + PERIOD_S:
                self._asked_s = now_s
                self._send(self._question)
            due_s = min(end_s, self._asked_s + PERIOD_S)
            for message in self._receive(max(due_s - now_s, 0.0)):
                newest = self._follow(message) or newest
            if time.monotonic() >= end_s:
                break
        return newest

    def close(self) -> None:
        """Close the link."""
        self._link.close()

    # The begin --------------------------------------------------------------------------------------------------------

    def _greet(self) -> None:
        """Wait for the firmware's name; raises DeviceError if there is none."""
        end_s, received = time.monotonic() + STARTS_WITHIN_S, 0
        while (now_s := time.monotonic()) < end_s:
            self._send(protocol.REPORT_FIRMWARE)
            while (left_s := min(now_s + _ASK_EVERY_S, end_s) - time.monotonic()) > 0.0:
                data = self._link.read(left_s)
                received += len(data)
                if any(isinstance(found, Firmware) for found in self._reader.feed(data)):
                    return
        what = f"{received} bytes that are no Firmata" if received else "nothing"
        raise DeviceError(
            f"{self._address}: no Firmata answers, {what};"
            f" is StandardFirmata on it, and its baud rate {self._board.baud}?"
        )

    def _check_version(self) -> None:
        version = self._ask(protocol.REPORT_VERSION, Version)
        if version.major != protocol.MAJOR_VERSION:
            found = f"{version.major}.{version.minor}"
            raise DeviceError(
                f"{self._address}: it speaks Firmata {found}, not {protocol.MAJOR_VERSION}"
            )

    def _check_board(self) -> None:
        """Raise DeviceError for a pin that cannot do what the board says."""
        board = self._board
        modes = self._ask(protocol.CAPABILITY_QUERY, Capabilities).modes
        uses = [(f"{name}.pwm", m.pwm, PinMode.PWM) for name, m in _motors(board)]
        uses += [
            (f"{name}.{key}", pin, PinMode.OUTPUT)
            for name, motor in _motors(board)
            for key, pin in (("ahead", motor.ahead), ("back", motor.back))
            if pin is not None
        ]
        for key, pin, mode in uses:
            if pin >= len(modes) or mode not in modes[pin]:
                able = ", ".join(str(k) for k, found in enumerate(modes) if mode in found)
                raise DeviceError(
                    f"{self._address}: {key}: pin {pin} cannot be {mode.name}; these can: {able}"
                )
        mapping = self._ask(protocol.ANALOG_MAPPING_QUERY, AnalogMapping).channels
        for channel in board.channels:
            if channel not in mapping:
                raise DeviceError(f"{self._address}: analog: it has no channel {channel}")

    def _ask(self, question: bytes, kind: type[M]) -> M:
        for _ in range(_QUESTIONS):
            self._send(protocol.END_SYSEX + question)
            end_s = time.monotonic() + _ASK_EVERY_S
            while (left_s := end_s - time.monotonic()) > 0.0:
                for message in self._receive(left_s):
                    if isinstance(message, kind):
                        return message
        raise DeviceLostError(f"{self._address}: does not answer any more")

    # Messages ---------------------------------------------------------------------------------------------------------

    @property
    def _question(self) -> bytes:
        return b"".join(map(protocol.query_pin, self._board.pins))

    def _follow(self, message: Message) -> Readout | None:
        """Return what is known when all pins have been answered for, one after the other."""
        if isinstance(message, AnalogValue):
            self.values[message.channel] = message.value
        elif isinstance(message, Firmware):
            raise DeviceLostError(f"{self._address}: the robot was reset")
        elif isinstance(message, PinState):
            return self._follow_pin(message)
        return None

    def _follow_pin(self, state: PinState) -> Readout | None:
        pins, is_complete = self._board.pins, len(self._round) == len(self._board.pins)
        if state.pin == _MARKER_PIN:
            if not is_complete:
                return None
            self._is_after_stop = True
        else:
            if is_complete:
                self._round = []
            if state.pin != pins[len(self._round)]:
                self._round = []  # an answer is missing
            if state.pin == pins[len(self._round)]:
                self._round.append(state)
            if len(self._round) < len(pins):
                return None
        if not self.values.keys() >= set(self._board.channels):
            return None
        states = {found.pin: found for found in self._round}
        if not wheels.are_modes_kept(self._board, states):
            raise DeviceLostError(f"{self._address}: its pins were set to something else")
        return Readout(
            wheels.speeds(self._board, states),
            wheels.are_still(self._board, states),
            self._is_after_stop,
        )

    def _receive(self, timeout_s: float) -> list[Message]:
        return self._reader.feed(self._link.read(timeout_s))

    def _send(self, data: bytes) -> None:
        with self._writing:
            self._link.write(data)


def _motors(board: Board) -> tuple[tuple[str, Motor], ...]:
    return ("left", board.left), ("right", board.right)
