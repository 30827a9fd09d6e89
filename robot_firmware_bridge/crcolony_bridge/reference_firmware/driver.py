"""Robots with the reference firmware (`robot_firmware_bridge/firmware`), over a serial line or TCP.

The firmware stops the wheels when a command's time to live is over, and a hardware watchdog when the firmware hangs.
This side keeps neither: it commands afresh in every control period, and says truthfully in which state the robot is.
"""

import secrets
import time
from collections.abc import Callable

from crcolony.body import contract
from crcolony.compiled import FloatArray
from crcolony_bridge.driver import DriverState, Reading, RobotDescription, limited_action
from crcolony_bridge.errors import DeviceError, DeviceLostError
from crcolony_bridge.infrared.ir_messages import Fragment, IrReceiver, seal, tag_of
from crcolony_bridge.link import Link, open_link, renumbered
from crcolony_bridge.reconnecting_driver import ReconnectingDriver
from crcolony_bridge.reference_firmware import messages
from crcolony_bridge.reference_firmware.frames import MAX_PAYLOAD_BYTES, Frame, FrameError
from crcolony_bridge.reference_firmware.messages import (
    Command,
    Info,
    MessageType,
    Telemetry,
)
from crcolony_bridge.reference_firmware.readings import describe_robot, reading_of
from crcolony_bridge.reference_firmware.session import FirmwareSession

BAUD = 500_000
_TELEMETRY_PERIOD_MS = 20
_IR_PART_BYTES = MAX_PAYLOAD_BYTES - 9
_MAX_IR_MESSAGES = 32
_MM = 1e-3


class SerialFirmware(ReconnectingDriver):
    """A robot with the reference firmware. `uid` is the one that is expected there, "" for any."""

    def __init__(
        self,
        address: str,
        uid: str = "",
        baud: int = BAUD,
        connect: Callable[[str, int], Link] = open_link,
    ) -> None:
        super().__init__(RobotDescription("crcolony reference robot", uid))
        self._address, self._uid, self._baud, self._open_link = address, uid, baud, connect
        self._session_id = secrets.randbits(32)
        self._session: FirmwareSession | None = None
        self._info: Info | None = None
        self._ir = IrReceiver()
        self._ir_messages: list[bytes] = []
        """Messages that have become complete since the last reading"""

    def write(self, action: FloatArray) -> FloatArray:
        """See `Driver`."""
        max_ttl_s = self._info.max_ttl_ms * _MM if self._info else 0.0
        may_move = self._state is DriverState.ACTIVE
        applied = limited_action(action, self._description, max_ttl_s, may_move=may_move)
        left, right = applied[contract.WHEEL_LEFT], applied[contract.WHEEL_RIGHT]
        red, green, blue = (
            round(255 * level) for level in applied[contract.LED : contract.LED + 3]
        )
        self._command(
            Command(
                self._session_id,
                round(left / _MM),
                round(right / _MM),
                round(applied[contract.TTL] / _MM),
                (red, green, blue),
                round(255 * applied[contract.SPEAKER]),
                bool(applied[contract.JAW] > 0.5),
                bool(applied[contract.BEACON] > 0.5),
            )
        )
        return applied

    def send_ir(self, message: bytes) -> bool:
        """See `Driver`."""
        # A word is its own message: what it belongs to has a checksum.
        sealed = message if self._description.ir == "tokens" else seal(message)
        tag, total = tag_of(sealed), len(sealed)
        if self._info is None or total > self._info.max_ir_bytes:
            return False

        def load(offset: int) -> Callable[[int], Frame]:
            part = sealed[offset : offset + _IR_PART_BYTES]
            return lambda seq: messages.ir_load(self._session_id, tag, total, offset, part, seq)

        return all(self._request(load(offset)) for offset in range(0, total, _IR_PART_BYTES))

    # The link ---------------------------------------------------------------------------------------------------------

    def _connect(self) -> None:
        """Connect, to the same robot under another number if its device was renumbered."""
        others = renumbered(self._address) if self._uid else []
        for address in others:
            try:
                self._connect_to(address)
            except (DeviceError, DeviceLostError):
                self._disconnect()
            else:
                self._address = address
                return
        self._connect_to(self._address)

    def _connect_to(self, address: str) -> None:
        session = FirmwareSession(self._open_link(address, self._baud), address)
        self._session = session
        info = session.greet(self._session_id, _TELEMETRY_PERIOD_MS)
        uid = info.uid.hex()
        if self._uid and uid != self._uid:
            raise DeviceError(f"{self._address}: robot {uid} is there, not {self._uid}")
        if self._info is None or self._info.description_crc != info.description_crc:
            text = session.fetch_description(info.description_bytes)
            period_s = _TELEMETRY_PERIOD_MS * _MM
            self._description = describe_robot(text, info, period_s, self._address)
        self._info, self._uid = info, uid

    def _disconnect(self) -> None:
        session, self._session = self._session, None
        if session is not None:
            session.close()

    def _stand_still(self) -> None:
        self._command(Command(self._session_id, 0, 0, 0))

    def _send_stop(self) -> None:
        if self._session is not None:
            self._session.send(messages.stop)

    def _send_clear(self) -> None:
        if self._session is not None:
            self._session.send(lambda seq: messages.clear(self._session_id, seq))

    def _command(self, command: Command) -> None:
        if self._session is not None:
            try:
                self._session.send(command.frame)
            except DeviceLostError as error:
                self._lose(error)

    def _request(self, make: Callable[[int], Frame]) -> bool:
        """Make a request that is only acknowledged; return whether it was."""
        try:
            session = self._session
            return session is not None and session.request(make, MessageType.ACK) is not None
        except DeviceLostError as error:
            self._lose(error)
            return False

    def _receive_ir(self, fragment: Fragment) -> None:
        if self._description.ir == "tokens":
            self._ir_messages.append(fragment.data)
        elif (message := self._ir.add(fragment)) is not None:
            self._ir_messages.append(message)

    def _read(self, timeout_s: float) -> Reading | None:
        session, end_s = self._session, time.monotonic() + timeout_s
        newest: Telemetry | None = None
        while session is not None and newest is None:
            left_s = max(end_s - time.monotonic(), 0.0)
            for frame in session.receive(left_s):
                try:
                    if frame.type == MessageType.TELEMETRY:
                        newest = Telemetry.parse(frame)
                    elif frame.type == MessageType.IR_RECEIVED:
                        self._receive_ir(messages.parse_fragment(frame))
                    elif frame.type == MessageType.BOOT:
                        raise DeviceLostError(f"{self._address}: the robot was reset")
                except FrameError:
                    session.count_bad_frame()
            if left_s == 0.0:
                break
        if newest is None:
            return None
        received, self._ir_messages = tuple(self._ir_messages[-_MAX_IR_MESSAGES:]), []
        return reading_of(newest, self._description, received)
