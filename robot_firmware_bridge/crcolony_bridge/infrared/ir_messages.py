"""Messages over infrared: longer than a fragment, repeated in turn by the sender's beacon, put together here.

Nothing is acknowledged. A message is complete when all of its fragments have arrived and its digest is right: a CRC of
16 bits finds what is damaged in one fragment, but not that two messages were mixed.
"""

import hashlib
from collections import OrderedDict
from dataclasses import dataclass

_DIGEST_BYTES = 4
_MAX_OPEN = 8
"""Messages that are being put together; older ones are dropped."""
_MAX_FRAGMENTS = 64
_MAX_COMPLETE = 32
"""Messages that were complete lately and are not reported again."""


@dataclass(frozen=True)
class Fragment:
    """A part of a sealed message, as another robot has sent it."""

    tag: int
    """The same for all fragments of a message"""
    index: int
    count: int
    data: bytes


def seal(message: bytes) -> bytes:
    """Return what is sent for a message: with its digest."""
    return hashlib.blake2b(message, digest_size=_DIGEST_BYTES).digest() + message


def tag_of(sealed: bytes) -> int:
    """Return the tag of a message's fragments: different messages have others, most of the time."""
    return sealed[0]


class IrReceiver:
    """Puts fragments together, of several senders at a time, in bounded memory."""

    def __init__(self) -> None:
        self.damaged = 0
        """Complete messages with a wrong digest"""
        self._open: OrderedDict[tuple[int, int], dict[int, bytes]] = OrderedDict()
        self._complete: OrderedDict[bytes, None] = OrderedDict()

    def add(self, fragment: Fragment) -> bytes | None:
        """Add a fragment; return the message that it completes, once."""
        if fragment.count > _MAX_FRAGMENTS:
            return None
        key = fragment.tag, fragment.count
        parts = self._open.setdefault(key, {})
        self._open.move_to_end(key)
        if len(self._open) > _MAX_OPEN:
            self._open.popitem(last=False)
        if parts.get(fragment.index, fragment.data) != fragment.data:
            parts.clear()  # of another message with the same tag
        parts[fragment.index] = fragment.data
        if len(parts) < fragment.count:
            return None
        del self._open[key]
        return self._open_seal(b"".join(parts[k] for k in range(fragment.count)))

    def _open_seal(self, sealed: bytes) -> bytes | None:
        message = sealed[_DIGEST_BYTES:]
        if seal(message) != sealed:
            self.damaged += 1
            return None
        if message in self._complete:
            self._complete.move_to_end(message)
            return None
        self._complete[message] = None
        if len(self._complete) > _MAX_COMPLETE:
            self._complete.popitem(last=False)
        return message
