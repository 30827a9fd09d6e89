"""What a robot's infrared beacon says, and how two beacons that hear each other become a contact.

A beacon repeats its robot's id, a random token, and the token that it received last. Who receives the own token back
knows that both hear each other. Both sides then compute the nonce of their contact from the two ids and tokens: it is
the same on both. How a message becomes bytes depends on how much the infrared of a robot carries at once
(`whole_beacon.py`, `short_beacon.py`).
"""

import hashlib
import secrets
from collections import OrderedDict
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Protocol

from crcolony.protocol.body_messages import Contact
from crcolony.protocol.identity import RobotId

_NONCE_BYTES = 6
_ENVELOPE_LIFE_S = 3.0
"""An envelope is repeated for so long, unless a newer one replaces it: its robot sends it again if it has to."""
_MAX_REPORTED = 64
"""Contacts that are remembered, so that none is reported twice."""


@dataclass(frozen=True)
class BeaconMessage:
    """One message of a beacon."""

    robot: RobotId
    token: bytes
    """Random, and not zeros"""
    heard: bytes = b""
    """The token that this robot received last, or nothing"""
    envelope: bytes = b""
    """A signed envelope for whom it concerns, or none"""


@dataclass(frozen=True)
class BeaconForm:
    """What differs between beacons whose robots' infrared carries more or less at once."""

    token_bytes: int
    token_life_s: float
    """Two robots that stay face to face have a contact as often as this"""
    has_envelopes: bool
    """Whether a message may have one: then a beacon may be on although its robot does not want to mate"""
    answer_s: float = 0.0
    """After a contact a beacon stays on for so long, whatever its robot wants: the other side is to have it, too"""


class BeaconEncoding(Protocol):
    """How the messages of one beacon go by the infrared of its robot."""

    @property
    def form(self) -> BeaconForm:
        """What messages can have."""
        ...

    def encode(self, now_s: float, message: BeaconMessage) -> bytes:
        """Return what the robot has to repeat from now on."""
        ...

    def decode(
        self, now_s: float, received: Iterable[bytes], online: Iterable[RobotId]
    ) -> list[BeaconMessage]:
        """Return the messages that are complete by what was received; `online` are the robots on the network."""
        ...


class Beacon:
    """The beacon of one robot. `draw` returns so many random bytes."""

    def __init__(
        self,
        robot: RobotId,
        form: BeaconForm,
        draw: Callable[[int], bytes] = secrets.token_bytes,
    ) -> None:
        self.robot, self._form, self._draw = robot, form, draw
        self.is_ready = True
        """Whether its robot wants to mate: otherwise there are no contacts, only what a mating still has to say"""
        self._token, self._token_until_s = b"", 0.0
        self._heard = b""
        self._answered_until_s = 0.0
        self._envelope, self._envelope_until_s = b"", 0.0
        self._reported: OrderedDict[int, None] = OrderedDict()
        """The nonces of the last contacts"""

    def message(self, now_s: float) -> BeaconMessage:
        """Return what to send from now on."""
        if not self._token or now_s >= self._token_until_s:
            self._token = self._new_token()
            self._token_until_s = now_s + self._form.token_life_s
        if now_s >= self._envelope_until_s:
            self._envelope = b""
        says_heard = self.is_ready or not self._form.has_envelopes
        heard = self._heard if says_heard else b""
        return BeaconMessage(self.robot, self._token, heard, self._envelope)

    def must_be_on(self, now_s: float) -> bool:
        """Return whether a mating has begun that needs the beacon: for an envelope, or for the other side's contact."""
        has_envelope = bool(self._envelope) and now_s < self._envelope_until_s
        return has_envelope or now_s < self._answered_until_s

    def load(self, now_s: float, envelope: bytes) -> None:
        """Send an envelope from now on, in place of the one before, if messages may have one."""
        if self._form.has_envelopes:
            self._envelope, self._envelope_until_s = envelope, now_s + _ENVELOPE_LIFE_S

    def receive(self, now_s: float, message: BeaconMessage) -> Contact | None:
        """Handle what was heard; return the contact that it completes, once."""
        if message.robot == self.robot:
            return None  # a reflection
        if now_s >= self._answered_until_s:
            self._heard = message.token
        if not self.is_ready or not self._token or message.heard != self._token:
            return None
        nonce = _nonce((self.robot, self._token), (message.robot, message.token))
        if nonce in self._reported:
            return None
        self._reported[nonce] = None
        if len(self._reported) > _MAX_REPORTED:
            self._reported.popitem(last=False)
        self._heard, self._answered_until_s = message.token, now_s + self._form.answer_s
        return Contact(message.robot, nonce)

    def _new_token(self) -> bytes:
        """Return a token that is not zeros: these say that nothing was heard."""
        token = self._draw(self._form.token_bytes)
        return token if any(token) else bytes([*token[:-1], 1])


def _nonce(one: tuple[RobotId, bytes], other: tuple[RobotId, bytes]) -> int:
    """Return the nonce of a contact, the same for both orders."""
    digest = hashlib.blake2b(
        b"".join(map(b"".join, sorted((one, other)))), digest_size=_NONCE_BYTES
    )
    return int.from_bytes(digest.digest(), "big")
