"""The Firmata protocol, version 2: the messages that a robot with StandardFirmata needs, as bytes.

Nothing guards them: there is no CRC. What a reader cannot understand it leaves out, within bounded memory.
"""

import enum
from dataclasses import dataclass

BAUD = 57_600
"""Of StandardFirmata."""
MAJOR_VERSION = 2
MAX_SYSEX_BYTES = 2048
"""Of a message that is kept; the capabilities of an Arduino Mega have about 600."""
SYSTEM_RESET = b"\xff"
"""All pins as after a reset: every digital one is an output, and low"""
REPORT_VERSION = b"\xf9"
END_SYSEX = b"\xf7"
REPORT_FIRMWARE = b"\xf0\x79\xf7"
CAPABILITY_QUERY = b"\xf0\x6b\xf7"
ANALOG_MAPPING_QUERY = b"\xf0\x69\xf7"
MAX_PIN, MAX_CHANNEL, MAX_PORT = 127, 15, 15

_START, _END = 0xF0, 0xF7
_ANALOG, _VERSION = 0xE0, 0xF9
_FIRMWARE, _CAPABILITIES, _ANALOG_MAPPING, _PIN_STATE = 0x79, 0x6C, 0x6A, 0x6E
_PARAMETER_BYTES = {0x90: 2, 0xE0: 2}
"""Of messages with a port or channel in their first byte"""
_NOT_SUPPORTED = 0x7F


class PinMode(enum.IntEnum):
    """What a pin is used for."""

    INPUT = 0
    OUTPUT = 1
    ANALOG = 2
    PWM = 3


@dataclass(frozen=True)
class Version:
    """The version of the protocol."""

    major: int
    minor: int


@dataclass(frozen=True)
class Firmware:
    """The firmware's name and its version; it sends this by itself when it starts."""

    major: int
    minor: int
    name: str


@dataclass(frozen=True)
class Capabilities:
    """For every pin the modes that it can have."""

    modes: tuple[frozenset[int], ...]


@dataclass(frozen=True)
class AnalogMapping:
    """For every pin its analog channel, None for one that measures nothing."""

    channels: tuple[int | None, ...]


@dataclass(frozen=True)
class PinState:
    """What the firmware has a pin set to: the level that was written last, not what is measured at it."""

    pin: int
    mode: int
    level: int


@dataclass(frozen=True)
class AnalogValue:
    """What a channel has measured."""

    channel: int
    value: int


Message = Version | Firmware | Capabilities | AnalogMapping | PinState | AnalogValue


def set_pin_mode(pin: int, mode: PinMode) -> bytes:
    """Use a pin for something; one for PWM begins with 0."""
    return bytes((0xF4, pin, mode))


def write_pwm(pin: int, level: int) -> bytes:
    """Set the level of a pin for PWM, from 0 to 255."""
    low, high = level & 0x7F, level >> 7
    if pin <= MAX_CHANNEL:
        return bytes((_ANALOG | pin, low, high))
    return bytes((_START, 0x6F, pin, low, high, _END))


def write_port(port: int, levels: int) -> bytes:
    """Set all outputs among the eight pins from `8 * port` on: a bit each, the lowest pin in the lowest one."""
    return bytes((0x90 | port, levels & 0x7F, levels >> 7))


def query_pin(pin: int) -> bytes:
    """Ask for a `PinState`."""
    return bytes((_START, 0x6D, pin, _END))


def report_analog(channel: int) -> bytes:
    """Ask for an `AnalogValue` of a channel in every sampling interval."""
    return bytes((0xC0 | channel, 1))


def sampling_interval(ms: int) -> bytes:
    """Set how often channels are reported."""
    return bytes((_START, 0x7A, ms & 0x7F, ms >> 7, _END))


class FirmataReader:
    """Finds messages in a stream of bytes, whatever it is that arrives."""

    def __init__(self) -> None:
        self._pending = bytearray()
        """Of a message that has begun"""
        self._needed = 0
        """How many bytes it has; 0 while that is open"""

    def feed(self, data: bytes) -> list[Message]:
        """Return the messages that have become complete; what is none is left out."""
        return [message for byte in data if (message := self._take(byte)) is not None]

    def _take(self, byte: int) -> Message | None:
        if byte == _END and self._pending[:1] == b"\xf0":
            sysex, self._pending = bytes(self._pending[1:]), bytearray()
            return _parse_sysex(sysex)
        if byte >= 0x80:  # whatever had begun is over
            parameters = 2 if byte == _VERSION else _PARAMETER_BYTES.get(byte & 0xF0, 0)
            self._needed = 1 + parameters if byte != _START else 0
            self._pending = bytearray((byte,)) if parameters or byte == _START else bytearray()
            return None
        if not self._pending:
            return None
        self._pending.append(byte)
        if self._needed == 0:
            if len(self._pending) > MAX_SYSEX_BYTES:
                self._pending.clear()
            return None
        if len(self._pending) < self._needed:
            return None
        command, first, second = self._pending
        self._pending.clear()
        if command == _VERSION:
            return Version(first, second)
        if command & 0xF0 == _ANALOG:
            return AnalogValue(command & 0x0F, first | second << 7)
        return None


def _parse_sysex(sysex: bytes) -> Message | None:
    """Return the message between its first and its last byte, None for one that is not needed or makes no sense."""
    kind, body = sysex[:1], sysex[1:]
    if kind == bytes((_PIN_STATE,)) and len(body) >= 3:
        return PinState(body[0], body[1], sum(part << 7 * k for k, part in enumerate(body[2:6])))
    if kind == bytes((_FIRMWARE,)) and len(body) >= 2:
        return Firmware(body[0], body[1], _name(body[2:]))
    if kind == bytes((_ANALOG_MAPPING,)):
        return AnalogMapping(tuple(None if c == _NOT_SUPPORTED else c for c in body))
    if kind == bytes((_CAPABILITIES,)):
        pins = body.split(bytes((_NOT_SUPPORTED,)))[:-1]  # pairs of a mode and its bits
        return Capabilities(tuple(frozenset(pin[::2]) for pin in pins))
    return None


def _name(body: bytes) -> str:
    """Return characters, each in two parts of seven bits."""
    pairs = zip(body[::2], body[1::2], strict=False)
    text = bytes((low | high << 7) & 0xFF for low, high in pairs).decode("latin-1")
    return "".join(letter if letter.isprintable() else "?" for letter in text)
