"""How a robot gets a body: its request and the arena's reply are signed, and each names what the other one said.

From both follow the keys of the link (`link_keys.py`). A request is for one run of an arena, and has a number that
grows with each, so that one which is replayed does nothing.
"""

import hashlib
from dataclasses import dataclass

from crcolony.protocol.body_messages import (
    DIGEST_BYTES,
    BodyDenied,
    BodyGranted,
    Join,
    Leave,
    decode_join,
    decode_join_reply,
)
from crcolony.protocol.codec import WireError, encode
from crcolony.protocol.identity import ArenaId, Identity, arena_id, robot_id
from crcolony.protocol.link_keys import ExchangeKey, LinkKeys
from crcolony.protocol.signed_envelope import (
    SignedEnvelope,
    decode_envelope,
    is_valid,
    sign_content,
)


@dataclass(frozen=True)
class Request:
    """What a robot asks of an arena, as it was received; `is_signed` verifies the signature, which costs most."""

    message: Join | Leave
    envelope: SignedEnvelope

    @property
    def order(self) -> tuple[int, int]:
        """Grows with every request of a robot."""
        return self.message.incarnation, self.message.count

    @property
    def digest(self) -> bytes:
        """Names this request in its reply."""
        return _digest(self.envelope.content)

    def is_signed(self, arena: str) -> bool:
        """Return whether the robot itself signed it, for an arena of this name."""
        return is_valid(self.envelope, _purpose(arena))


def sign_request(message: Join | Leave, arena: str, robot: Identity) -> bytes:
    """Return the encoded envelope of a request."""
    return sign_content(encode(message), _purpose(arena), robot)


def open_request(data: bytes) -> Request:
    """Return a request whose signature is not verified; raises WireError if it is malformed or of another key."""
    envelope = decode_envelope(data)
    message = decode_join(envelope.content)
    if robot_id(envelope.key) != message.robot:
        raise WireError("the envelope's key is not the robot's")
    return Request(message, envelope)


def sign_reply(reply: BodyGranted | BodyDenied, arena: str, identity: Identity) -> bytes:
    """Return the encoded envelope of a reply."""
    return sign_content(encode(reply), _purpose(arena), identity)


def keys_of_grant(own: ExchangeKey, request: Request, granted: BodyGranted) -> LinkKeys:
    """Return the keys of the link that an arena grants; raises WireError if the robot's key is none."""
    assert isinstance(request.message, Join)
    return own.agree(request.message.exchange_key, request.envelope.content + encode(granted))


@dataclass(frozen=True)
class Reply:
    """An arena's reply, whose signature is valid."""

    message: BodyGranted | BodyDenied
    arena: ArenaId
    keys: LinkKeys | None
    """Of the link, if the robot has a body"""


class PendingRequest:
    """A request of a robot for a body. It is sent again as it is until it is answered: `secret` are 32 random bytes."""

    def __init__(self, join: Join, arena: str, robot: Identity, own: ExchangeKey) -> None:
        self.join = join
        self.data = sign_request(join, arena, robot)
        self._content, self._arena, self._own = encode(join), arena, own

    def open_reply(self, data: bytes) -> Reply:
        """Return the arena's reply to this request; raises WireError if it is not signed, or to another request."""
        envelope = decode_envelope(data)
        message = decode_join_reply(envelope.content)
        if message.request != _digest(self._content):
            raise WireError("it replies to another request")
        if not is_valid(envelope, _purpose(self._arena)):
            raise WireError("its signature is not valid")
        keys = None
        if isinstance(message, BodyGranted):
            keys = self._own.agree(message.exchange_key, self._content + envelope.content)
        return Reply(message, arena_id(envelope.key), keys)


def _purpose(arena: str) -> str:
    return f"body {arena}"


def _digest(content: bytes) -> bytes:
    return hashlib.blake2b(content, digest_size=DIGEST_BYTES).digest()
