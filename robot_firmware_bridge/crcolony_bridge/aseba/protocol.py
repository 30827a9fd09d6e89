"""The messages of Aseba (protocol 5), as Thymio II and e-puck speak it: length, source, type and words, little-endian.

Facts from Aseba's own sources, `common/consts.h`, `vm/vm.c` and `transport/buffer/vm-buffer.c`. There is no checksum
and no watchdog: what stops a robot that is left alone is a program that is uploaded to it (`program.py`).
"""

import enum
import struct
from dataclasses import dataclass, field

PROTOCOL_VERSION = 5
_HEADER = struct.Struct("<HHH")
MAX_EVENT_WORDS = 258
"""The most words that a message holds."""
_MAX_PAYLOAD_BYTES = 2 * MAX_EVENT_WORDS


class AsebaError(ValueError):
    """Bytes that are no message, or a message that is not what it should be."""


class AsebaType(enum.IntEnum):
    """Types of the messages that are used here; types below 0x8000 are a program's own events."""

    DESCRIPTION = 0x9000
    NAMED_VARIABLE = 0x9001
    LOCAL_EVENT = 0x9002
    NATIVE_FUNCTION = 0x9003
    DISCONNECTED = 0x9004
    VARIABLES = 0x9005
    ACCESS_OUT_OF_BOUNDS = 0x9006
    DIVISION_BY_ZERO = 0x9007
    EXECUTION_KILLED = 0x9008
    NODE_ERROR = 0x9009
    EXECUTION_STATE = 0x900A
    NODE_PRESENT = 0x900C
    SET_BYTECODE = 0xA001
    RESET = 0xA002
    RUN = 0xA003
    GET_VARIABLES = 0xA00B
    SET_VARIABLES = 0xA00C
    GET_NODE_DESCRIPTION = 0xA010
    LIST_NODES = 0xA011


FIRST_SYSTEM_TYPE = 0x8000
EVENT_INIT = 0xFFFF
FIRST_LOCAL_EVENT = 0xFFFE
"""Local event k has this number minus k."""


@dataclass(frozen=True)
class AsebaMessage:
    """One message; `source` is the node that has sent it."""

    type: int
    payload: bytes
    source: int = 0

    @property
    def words(self) -> tuple[int, ...]:
        """The payload as signed words; an odd byte at the end is left out."""
        return struct.unpack(
            f"<{len(self.payload) // 2}h", self.payload[: len(self.payload) // 2 * 2]
        )


def encode_message(message: AsebaMessage) -> bytes:
    """Return a message's bytes."""
    return _HEADER.pack(len(message.payload), message.source, message.type) + message.payload


def request(type_: AsebaType, *words: int) -> AsebaMessage:
    """Return a message of words, which may be signed or unsigned."""
    return AsebaMessage(type_, struct.pack(f"<{len(words)}H", *(word & 0xFFFF for word in words)))


class AsebaReader:
    """Splits a stream of bytes into messages. It has no checksum: after a wrong length there is no way back into it."""

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> list[AsebaMessage]:
        """Return the messages that these bytes complete; raises AsebaError for a length that no message has."""
        rest, messages = self._rest + data, []
        offset = 0
        while len(rest) - offset >= _HEADER.size:
            length, source, type_ = _HEADER.unpack_from(rest, offset)
            if length > _MAX_PAYLOAD_BYTES:
                raise AsebaError(f"a message of {length} bytes, where {_MAX_PAYLOAD_BYTES} is most")
            end = offset + _HEADER.size + length
            if len(rest) < end:
                break
            messages.append(AsebaMessage(type_, rest[offset + _HEADER.size : end], source))
            offset = end
        self._rest = rest[offset:]
        return messages


@dataclass
class NodeDescription:
    """What a node is: addresses of its variables, and its local events and native functions in order."""

    node: int
    name: str
    bytecode_words: int
    variable_words: int
    addresses: dict[str, tuple[int, int]] = field(default_factory=dict)
    """Address and size in words of every variable, by its name"""
    local_events: list[str] = field(default_factory=list)
    natives: list[str] = field(default_factory=list)
    _expected_variables: int = 0
    _expected_events: int = 0
    _expected_natives: int = 0
    _used_words: int = 0

    @property
    def is_complete(self) -> bool:
        """Whether all variables, events and native functions have been described."""
        return (
            len(self.addresses) >= self._expected_variables
            and len(self.local_events) >= self._expected_events
            and len(self.natives) >= self._expected_natives
        )

    @property
    def first_free_word(self) -> int:
        """Address of the first word that a program may use for itself."""
        return self._used_words

    def address(self, name: str, size: int = 1) -> int:
        """Return a variable's address; raises AsebaError if it is missing, or smaller than this."""
        found = self.addresses.get(name)
        if found is None or found[1] < size:
            raise AsebaError(f"{self.name} has no variable {name} of {size} words")
        return found[0]

    def event(self, name: str) -> int:
        """Return a local event's number; raises AsebaError if there is none of this name."""
        if name not in self.local_events:
            raise AsebaError(f"{self.name} has no event {name}")
        return FIRST_LOCAL_EVENT - self.local_events.index(name)

    def add(self, message: AsebaMessage) -> None:
        """Add a part of the description; raises AsebaError if it is none."""
        if message.type == AsebaType.NAMED_VARIABLE:
            (size,) = _unpack("<H", message.payload)
            name, _ = _read_text(message.payload, 2)
            self.addresses[name] = (self._used_words, size)
            self._used_words += size
        elif message.type == AsebaType.LOCAL_EVENT:
            self.local_events.append(_read_text(message.payload, 0)[0])
        elif message.type == AsebaType.NATIVE_FUNCTION:
            self.natives.append(_read_text(message.payload, 0)[0])


def parse_description(message: AsebaMessage) -> NodeDescription:
    """Return the description that this message begins; raises AsebaError if it is none, or of another protocol."""
    name, offset = _read_text(message.payload, 0)
    version, bytecode, _stack, variables, named, events, natives = _unpack(
        "<7H", message.payload[offset:]
    )
    if version != PROTOCOL_VERSION:
        raise AsebaError(
            f"{name} speaks version {version} of Aseba's protocol, not {PROTOCOL_VERSION}"
        )
    return NodeDescription(
        message.source,
        name.strip(),
        bytecode,
        variables,
        _expected_variables=named,
        _expected_events=events,
        _expected_natives=natives,
    )


def _unpack(layout: str, data: bytes) -> tuple[int, ...]:
    if len(data) < struct.calcsize(layout):
        raise AsebaError("a message that is too short")
    return struct.unpack_from(layout, data)


def _read_text(data: bytes, offset: int) -> tuple[str, int]:
    """Return a text with its length before it, and the offset behind it."""
    if offset >= len(data) or offset + 1 + data[offset] > len(data):
        raise AsebaError("a text that is cut off")
    end = offset + 1 + data[offset]
    return data[offset + 1 : end].decode("utf-8", "replace"), end
