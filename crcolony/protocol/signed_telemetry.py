"""Telemetry with a count, its sender's key and a signature behind it (PROTOCOL.md, "Telemetry").

They stand behind the message and not around it, so that a large scene is neither copied nor encoded once more, and what
is recorded is the message alone.
"""

import struct
from dataclasses import dataclass

from crcolony.protocol.codec import WireError
from crcolony.protocol.identity import KEY_BYTES, SIGNATURE_BYTES, Identity, is_signed
from crcolony.protocol.signed_envelope import signed_text

_COUNT = struct.Struct(">Q")
TRAILER_BYTES = _COUNT.size + KEY_BYTES + SIGNATURE_BYTES


@dataclass(frozen=True, slots=True)
class SignedTelemetry:
    """A message as it was received; `is_valid` verifies the signature, which costs most."""

    content: bytes
    count: int
    """Grows with every state of a robot, so that an old one is told from a new one"""
    key: bytes
    signature: bytes

    def is_valid(self, purpose: str) -> bool:
        """Return whether the owner of the key signed content and count for this purpose."""
        text = signed_text(self.content + _COUNT.pack(self.count), purpose)
        return is_signed(text, self.signature, self.key)


def sign_telemetry(content: bytes, purpose: str, sender: Identity, count: int = 0) -> bytes:
    """Return a message, a count (0 to 2^64 - 1), the sender's key, and the signature for a purpose."""
    counted = content + _COUNT.pack(count)
    return counted + sender.public_key + sender.sign(signed_text(counted, purpose))


def open_telemetry(data: bytes) -> SignedTelemetry:
    """Return a message whose signature is not verified; raises WireError if there is none."""
    content, trailer = data[:-TRAILER_BYTES], data[-TRAILER_BYTES:]
    if not content:
        raise WireError("not signed")
    (count,) = _COUNT.unpack_from(trailer)
    key, signature = trailer[_COUNT.size : -SIGNATURE_BYTES], trailer[-SIGNATURE_BYTES:]
    return SignedTelemetry(content, count, key, signature)


def purpose_of_robot(colony: str) -> str:
    """Return the purpose of what a robot tells observers."""
    return f"telemetry {colony}"


def purpose_of_arena(arena: str) -> str:
    """Return the purpose of what an arena tells observers."""
    return f"arena {arena}"
