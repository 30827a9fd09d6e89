"""MessagePack with one canonical form and a limit on everything (PROTOCOL.md, "Messages").

A message is an array of its name and its fields. msgpack packs and unpacks the bytes; msgspec checks the values.
"""

from typing import Annotated, Any, Generic, TypeVar

import msgpack  # type: ignore[import-untyped]
import msgspec
from msgspec import Meta

from crcolony.protocol.identity import ID_BYTES

VERSION = 1
"""Version of the protocol. Every key expression contains it, so that robots of two versions do not interact."""

MAX_ENVELOPE_BYTES = 65_536
"""Largest signed envelope; it has room for 4,096 genes."""
MAX_BODY_MESSAGE_BYTES = 4_096
"""Largest message between a robot and its body, and largest state of a robot."""
MAX_SCENE_BYTES = 262_144
"""Largest scene: some thousands of robots and packs."""
MAX_ITEMS = 32
"""Longest array in a message without lists: no message has more fields."""

Id = Annotated[bytes, Meta(min_length=ID_BYTES, max_length=ID_BYTES)]
Ordinal = Annotated[int, Meta(ge=0, lt=2**32)]
Tick = Annotated[int, Meta(ge=0, lt=2**53)]
ArenaRun = Annotated[int, Meta(ge=0, lt=2**62)]
"""Id of one run of an arena."""
Name = Annotated[str, Meta(pattern=r"^[A-Za-z0-9_.-]{1,64}\Z")]
"""Name of a colony or an arena; it is a chunk of key expressions."""


class WireError(Exception):
    """Received bytes are not a valid message of the expected kind."""


class Message(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """Base of all messages that travel as an array of their name and their fields."""


_BYTES = (bytes,)
"""Tells msgspec that bytes need no conversion into text."""

_packer = msgpack.Packer()


def encode(message: msgspec.Struct) -> bytes:
    """Return a message in its canonical form."""
    packed: bytes = _packer.pack(msgspec.to_builtins(message, builtin_types=_BYTES))
    return packed


_canonical_form = msgspec.msgpack.Encoder().encode
"""Only compares: what is sent is packed by msgpack."""

T = TypeVar("T")


class StrictDecoder(Generic[T]):
    """Decodes received bytes of one kind of message, which may be a union of messages.

    `max_bytes` bounds the message and `max_items` every array in it; both are checked before memory is reserved.
    """

    def __init__(self, kind: Any, max_bytes: int, max_items: int = MAX_ITEMS) -> None:
        # msgspec analyses the fields of a struct once, but a bare union at every conversion.
        self._wrapper: Any = msgspec.defstruct("Wrapper", [("message", kind)], array_like=True)
        self._max_bytes = max_bytes
        self._max_items = max_items

    def decode(self, data: bytes) -> T:
        """Return the message; raise WireError unless `data` is exactly one valid message in canonical form."""
        if len(data) > self._max_bytes:
            raise WireError(f"{len(data)} bytes, at most {self._max_bytes} are allowed")
        try:
            values = msgpack.unpackb(
                data, max_array_len=self._max_items, max_map_len=0, max_ext_len=0
            )
            message: T = msgspec.convert((values,), self._wrapper).message
        except (ValueError, msgspec.ValidationError) as error:
            raise WireError(str(error) or "not MessagePack") from None
        # msgspec's own encoder, the fastest, has the same canonical form. This also refuses what msgspec converts
        # silently: an integer into a float, a base64 text into bytes.
        if _canonical_form(message) != data:
            raise WireError("not in canonical form")
        return message
