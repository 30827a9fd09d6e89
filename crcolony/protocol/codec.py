"""What robots, arenas and observers say to each other: MessagePack with one canonical form, and a limit on everything.

    WireError                 bytes from outside that are no message, or more than a message may be

Every message is an array that begins with its name. Decoding is strict: the right fields in the right order, every
number in its range, nothing left over, and `encode(decode(b)) == b`, so that a signature or a hash of a message means
one thing only. Whatever comes in, `decode_…` returns a message or raises WireError, nothing else. PROTOCOL.md is the
specification for strangers.
"""

from typing import Annotated, Any, Generic, TypeVar

import msgspec
from msgspec import Meta

from crcolony.protocol.identity import ID_BYTES

VERSION = 1
"""Of the protocol; it is part of every key, so that robots of two versions never hear each other by accident."""

MAX_ENVELOPE_BYTES = 65_536
"""The longest letter between robots; it leaves room for 4,096 genes."""
MAX_BODY_MESSAGE_BYTES = 4_096
"""The longest message between a robot and its body, and of one robot's telemetry."""
MAX_SCENE_BYTES = 262_144
"""The longest scene: some thousands of robots and packs."""

Id = Annotated[bytes, Meta(min_length=ID_BYTES, max_length=ID_BYTES)]
Ordinal = Annotated[int, Meta(ge=0, lt=2**32)]
Tick = Annotated[int, Meta(ge=0, lt=2**53)]
Name = Annotated[str, Meta(pattern=r"^[A-Za-z0-9_.-]{1,64}\Z")]
"""Of a colony or an arena; it becomes part of a key expression."""


class WireError(Exception):
    """Bytes from outside that are no message."""


class Message(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """A message: an array of its name and its fields."""


# Between a robot and its body ---------------------------------------------------------------------------------------


# Encoding and decoding ----------------------------------------------------------------------------------------------

_encoder = msgspec.msgpack.Encoder()


def encode(message: Any) -> bytes:
    """Return a message's canonical bytes."""
    return _encoder.encode(message)


T = TypeVar("T")


class StrictDecoder(Generic[T]):
    """The one way in for bytes of one kind of message."""

    def __init__(self, kind: Any, most_bytes: int) -> None:
        self._decoder: msgspec.msgpack.Decoder[T] = msgspec.msgpack.Decoder(kind)
        self._most_bytes = most_bytes

    def decode(self, data: bytes) -> T:
        """Return the message; raises WireError for anything that is not one in its canonical form."""
        if len(data) > self._most_bytes:
            raise WireError(f"{len(data)} bytes, at most {self._most_bytes} are allowed")
        try:
            message = self._decoder.decode(data)
        except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
            raise WireError(str(error)) from None
        if _encoder.encode(message) != data:
            raise WireError("not in canonical form")
        return message
