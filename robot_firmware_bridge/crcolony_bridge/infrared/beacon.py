"""What a robot's infrared beacon says, and how two beacons that hear each other become a contact.

A beacon repeats its robot's id, a random token, and the token that it received last. Who receives the own token back
knows that both hear each other. Both sides then compute the nonce of their contact from the two ids and tokens: it is
the same on both, and nobody who was not there can know it. Behind these a message may have an envelope of a mating, for
robots that no other network connects.
"""

import hashlib
import secrets
import struct
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass

from crcolony.protocol.body_messages import Contact
from crcolony.protocol.identity import ID_BYTES, RobotId

TOKEN_BYTES = 6
_VERSION = 1
_MESSAGE = struct.Struct(f">B{ID_BYTES}s{TOKEN_BYTES}s{TOKEN_BYTES}s")
_NOTHING = bytes(TOKEN_BYTES)
_ENVELOPE_LIFE_S = 3.0
"""An envelope is repeated for so long, unless a newer one replaces it: its robot sends it again if it has to."""
_TOKEN_LIFE_S = 5.0
"""Two robots that stay face to face have a contact as often as this."""
_MAX_PEERS = 32
"""Robots whose last contact is remembered."""


@dataclass(frozen=True)
class BeaconMessage:
    """One message of a beacon."""

    robot: RobotId
    token: bytes
    """Random, TOKEN_BYTES long"""
    heard: bytes = _NOTHING
    """The token that this robot received last"""
    envelope: bytes = b""
    """A signed envelope for whom it concerns, or none"""

    def encode(self) -> bytes:
        """Return the bytes that are sent."""
        return _MESSAGE.pack(_VERSION, self.robot, self.token, self.heard) + self.envelope


def decode_beacon(data: bytes) -> BeaconMessage | None:
    """Return a beacon's message, None if the bytes are none: whatever emits infrared may send them."""
    if len(data) < _MESSAGE.size:
        return None
    version, robot, token, heard = _MESSAGE.unpack_from(data)
    if version != _VERSION:
        return None
    return BeaconMessage(robot, token, heard, data[_MESSAGE.size :])


class Beacon:
    """The beacon of one robot. `draw` returns so many random bytes."""

    def __init__(self, robot: RobotId, draw: Callable[[int], bytes] = secrets.token_bytes) -> None:
        self.robot, self._draw = robot, draw
        self.is_ready = True
        """Whether its robot wants to mate: otherwise there are no contacts, only what a mating still has to say"""
        self._token, self._token_until_s = _NOTHING, 0.0
        self._heard = _NOTHING
        self._envelope, self._envelope_until_s = b"", 0.0
        self._reported: OrderedDict[RobotId, int] = OrderedDict()
        """The nonce of the last contact with each robot"""

    def message(self, now_s: float) -> BeaconMessage:
        """Return what to send from now on."""
        if now_s >= self._token_until_s:
            self._token, self._token_until_s = self._draw(TOKEN_BYTES), now_s + _TOKEN_LIFE_S
        if now_s >= self._envelope_until_s:
            self._envelope = b""
        heard = self._heard if self.is_ready else _NOTHING
        return BeaconMessage(self.robot, self._token, heard, self._envelope)

    def has_envelope(self, now_s: float) -> bool:
        """Return whether there is an envelope to send."""
        return bool(self._envelope) and now_s < self._envelope_until_s

    def load(self, now_s: float, envelope: bytes) -> None:
        """Send an envelope from now on, in place of the one before."""
        self._envelope, self._envelope_until_s = envelope, now_s + _ENVELOPE_LIFE_S

    def receive(self, message: BeaconMessage) -> Contact | None:
        """Handle what was heard; return the contact that it completes, once."""
        if message.robot == self.robot:
            return None  # a reflection
        self._heard = message.token
        if not self.is_ready or message.heard != self._token or self._token == _NOTHING:
            return None
        nonce = _nonce((self.robot, self._token), (message.robot, message.token))
        if self._reported.get(message.robot) == nonce:
            return None
        self._reported[message.robot] = nonce
        self._reported.move_to_end(message.robot)
        if len(self._reported) > _MAX_PEERS:
            self._reported.popitem(last=False)
        return Contact(message.robot, nonce)


def _nonce(one: tuple[RobotId, bytes], other: tuple[RobotId, bytes]) -> int:
    """Return the nonce of a contact, the same for both orders."""
    digest = hashlib.blake2b(b"".join(map(b"".join, sorted((one, other)))), digest_size=TOKEN_BYTES)
    return int.from_bytes(digest.digest(), "big")
