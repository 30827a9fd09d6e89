"""A beacon's message as one message of infrared that carries any: id, tokens, and perhaps the envelope of a mating.

The envelope is for robots that no other network connects.
"""

import struct
from collections.abc import Iterable

from crcolony.protocol.identity import ID_BYTES, RobotId
from crcolony_bridge.infrared.beacon import BeaconForm, BeaconMessage

TOKEN_BYTES = 6
_VERSION = 1
_MESSAGE = struct.Struct(f">B{ID_BYTES}s{TOKEN_BYTES}s{TOKEN_BYTES}s")
_NOTHING = bytes(TOKEN_BYTES)

FORM = BeaconForm(TOKEN_BYTES, token_life_s=5.0, has_envelopes=True)


class WholeEncoding:
    """See `BeaconEncoding`."""

    form = FORM

    def encode(self, now_s: float, message: BeaconMessage) -> bytes:
        """See `BeaconEncoding`."""
        return encode_beacon(message)

    def decode(
        self, now_s: float, received: Iterable[bytes], online: Iterable[RobotId]
    ) -> list[BeaconMessage]:
        """See `BeaconEncoding`; a message names its robot, whether that is online or not."""
        return [message for message in map(decode_beacon, received) if message is not None]


def encode_beacon(message: BeaconMessage) -> bytes:
    """Return the bytes that are sent."""
    heard = message.heard or _NOTHING
    return _MESSAGE.pack(_VERSION, message.robot, message.token, heard) + message.envelope


def decode_beacon(data: bytes) -> BeaconMessage | None:
    """Return a beacon's message, None if the bytes are none: whatever emits infrared may send them."""
    if len(data) < _MESSAGE.size:
        return None
    version, robot, token, heard = _MESSAGE.unpack_from(data)
    if version != _VERSION:
        return None
    return BeaconMessage(robot, token, heard if any(heard) else b"", data[_MESSAGE.size :])
