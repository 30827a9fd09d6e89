"""The messages in frames, as `firmware/core/message.h` has them: little-endian structs.

Every payload may grow at its end: a receiver ignores bytes that it does not know, and refuses a payload that is too
short.
"""

import enum
import struct
from dataclasses import dataclass, fields
from typing import Any, Self

from crcolony_bridge.infrared.ir_messages import Fragment
from crcolony_bridge.reference_firmware.frames import Frame, FrameError

UID_BYTES = 8


class MessageType(enum.IntEnum):
    """The type of a frame."""

    HELLO = 0x01
    INFO = 0x02
    BOOT = 0x03
    DESCRIBE = 0x04
    DESCRIPTION = 0x05
    COMMAND = 0x10
    STOP = 0x11
    CLEAR = 0x12
    TELEMETRY = 0x20
    IR_LOAD = 0x30
    IR_RECEIVED = 0x31
    PING = 0x40
    PONG = 0x41
    IR_FRAGMENT = 0x50
    ACK = 0x7E
    NAK = 0x7F


class NakReason(enum.IntEnum):
    """Why a robot refuses a request."""

    VERSION = 1
    LENGTH = 2
    STOPPED = 3
    UNKNOWN = 4
    SESSION = 5
    BATTERY = 6


class ResetCause(enum.IntEnum):
    """Why a robot was reset."""

    POWER = 1
    BROWN_OUT = 2
    WATCHDOG = 3
    SOFTWARE = 4


class Status(enum.IntFlag):
    """The state of a robot in its telemetry."""

    STOPPED = 1
    BATTERY_LOW = 2
    BATTERY_CRITICAL = 4
    MOVING = 8
    JAW_HOLDS = 16
    EXPIRED = 32


class Capability(enum.IntFlag):
    """What a robot has."""

    IR = 1
    JAW = 2
    LED = 4
    SPEAKER = 8
    GYRO = 16


_HELLO = struct.Struct("<IH")
_COMMAND = struct.Struct("<IhhHBBBBB")
_INFO = struct.Struct(f"<IBHHHHH{UID_BYTES}s")
_BOOT = struct.Struct(f"<B{UID_BYTES}s")
_TELEMETRY = struct.Struct("<IHHHhhhhhHB")
_IR_LOAD = struct.Struct("<IBHH")
_FRAGMENT = struct.Struct("<BBB")
_IR_RECEIVED = struct.Struct("<Bh")
_U32 = struct.Struct("<I")
_OFFSETS = struct.Struct("<HH")
_JAW, _BEACON = 1, 2

UNKNOWN_MM = 0xFFFF
"""A proximity sensor that sees nothing."""


@dataclass(frozen=True)
class Command:
    """What a robot is to do for the next `ttl_ms`."""

    session: int
    left_mm_s: int
    right_mm_s: int
    ttl_ms: int
    lamp: tuple[int, int, int] = (0, 0, 0)
    speaker: int = 0
    jaw: bool = False
    beacon: bool = False

    def frame(self, seq: int) -> Frame:
        """Return the frame."""
        switches = self.jaw * _JAW | self.beacon * _BEACON
        payload = _COMMAND.pack(
            self.session,
            self.left_mm_s,
            self.right_mm_s,
            self.ttl_ms,
            *self.lamp,
            self.speaker,
            switches,
        )
        return Frame(MessageType.COMMAND, seq, payload)


@dataclass(frozen=True)
class Info:
    """What a robot is, in reply to a HELLO."""

    session: int
    proximity_sensors: int
    capabilities: Capability
    max_ttl_ms: int
    max_ir_bytes: int
    description_crc: int
    description_bytes: int
    uid: bytes

    @classmethod
    def parse(cls, frame: Frame) -> Self:
        """Return the message of a frame; raises FrameError if it is too short."""
        session, sensors, capabilities, *rest = _unpack(_INFO, frame)
        return cls(session, sensors, Capability(capabilities), *rest)


@dataclass(frozen=True)
class Boot:
    """A robot was reset: all that it had been told is gone, but for a latched stop."""

    cause: int
    uid: bytes

    @classmethod
    def parse(cls, frame: Frame) -> Self:
        """Return the message of a frame; raises FrameError if it is too short."""
        return cls(*_unpack(_BOOT, frame))


@dataclass(frozen=True)
class Telemetry:
    """What a robot measures; speeds in mm/s, positive ahead."""

    time_ms: int
    status: Status
    bad_frames: int
    command_seq: int
    applied_left_mm_s: int
    applied_right_mm_s: int
    left_mm_s: int
    right_mm_s: int
    gyro_mrad_s: int
    battery_mv: int
    proximity_mm: tuple[int, ...]

    @classmethod
    def parse(cls, frame: Frame) -> Self:
        """Return the message of a frame; raises FrameError if it is too short."""
        *values, count = _unpack(_TELEMETRY, frame)
        sensors = frame.payload[_TELEMETRY.size : _TELEMETRY.size + 2 * count]
        if len(sensors) < 2 * count:
            raise FrameError(f"telemetry without some of its {count} proximity sensors")
        named = dict(zip((field.name for field in fields(cls)), values, strict=False))
        named["status"] = Status(named["status"])
        return cls(**named, proximity_mm=struct.unpack(f"<{count}H", sensors))


def parse_fragment(frame: Frame) -> Fragment:
    """Return the fragment in an IR_RECEIVED; raises FrameError if it is none."""
    _unpack(_IR_RECEIVED, frame)
    payload = frame.payload[_IR_RECEIVED.size :]
    if len(payload) < _FRAGMENT.size:
        raise FrameError("an IR fragment without its header")
    tag, index, count = _FRAGMENT.unpack_from(payload)
    if index >= count:
        raise FrameError(f"IR fragment {index} of {count}")
    return Fragment(tag, index, count, payload[_FRAGMENT.size :])


def hello(session: int, period_ms: int, seq: int) -> Frame:
    """Return the request with which a controller takes a robot, and asks for telemetry at this period."""
    return Frame(MessageType.HELLO, seq, _HELLO.pack(session, period_ms))


def describe(offset: int, seq: int) -> Frame:
    """Return the request for a robot's description, from an offset on."""
    return Frame(MessageType.DESCRIBE, seq, struct.pack("<H", offset))


def stop(seq: int) -> Frame:
    """Return the emergency stop, which is latched."""
    return Frame(MessageType.STOP, seq, b"")


def clear(session: int, seq: int) -> Frame:
    """Return the release of the emergency stop."""
    return Frame(MessageType.CLEAR, seq, _U32.pack(session))


def ping(time_ms: int, seq: int) -> Frame:
    """Return a request that is answered at once, with the times of both."""
    return Frame(MessageType.PING, seq, _U32.pack(time_ms))


def ir_load(session: int, tag: int, total: int, offset: int, data: bytes, seq: int) -> Frame:
    """Return the request that loads a part of the message that a robot's beacon repeats."""
    return Frame(MessageType.IR_LOAD, seq, _IR_LOAD.pack(session, tag, total, offset) + data)


def parse_description(frame: Frame) -> tuple[int, int, bytes]:
    """Return total, offset and bytes of a part of a description; raises FrameError if it is too short."""
    total, offset = _unpack(_OFFSETS, frame)
    return total, offset, frame.payload[_OFFSETS.size :]


def _unpack(layout: struct.Struct, frame: Frame) -> tuple[Any, ...]:
    if len(frame.payload) < layout.size:
        raise FrameError(
            f"a message of type {frame.type:#04x} with only {len(frame.payload)} bytes"
        )
    return layout.unpack_from(frame.payload)
