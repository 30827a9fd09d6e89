"""The link between a robot and its body (PROTOCOL.md, "Getting a body", "The link"): from the request to the codes."""

import hmac
from hashlib import blake2b
from typing import Final, NamedTuple

from nacl.bindings import crypto_scalarmult
from nacl.exceptions import CryptoError
from nacl.public import PrivateKey
from nacl.signing import SigningKey

from tests.foreign.identity import ARENA, id_of, open_envelope, seal
from tests.foreign.messages import BODY_BYTES, Message, RefusedError, decode, encode

CODE_BYTES: Final = 16
MOST_TICKS_AHEAD: Final = 2**24
LINK: Final = b"crcolony body\0\0\0"


class LinkKeys(NamedTuple):
    observations: bytes
    actions: bytes


class Request(NamedTuple):
    arena_run: int
    content: bytes
    envelope: bytes
    exchange: PrivateKey


class Link(NamedTuple):
    """A body that was granted."""

    keys: LinkKeys
    arena_id: bytes
    slot: int
    arena_run: int
    period_s: float
    is_lockstep: bool


def agreed_keys(
    exchange: PrivateKey, other_exchange_key: bytes, request: bytes, reply: bytes
) -> LinkKeys:
    """Both ends compute the same; X25519 refuses a key of small order."""
    try:
        secret = crypto_scalarmult(bytes(exchange), other_exchange_key)
    except CryptoError:
        raise RefusedError("an exchange key of small order") from None
    both = blake2b(request + reply, digest_size=64, key=secret, person=LINK).digest()
    return LinkKeys(both[:32], both[32:])


def code(message: bytes, key: bytes) -> bytes:
    return blake2b(message, digest_size=CODE_BYTES, key=key).digest()


def with_code(message: bytes, key: bytes) -> bytes:
    return message + code(message, key)


def without_code(payload: bytes, key: bytes) -> bytes:
    message, its_code = payload[:-CODE_BYTES], payload[-CODE_BYTES:]
    if len(payload) <= CODE_BYTES or not hmac.compare_digest(code(message, key), its_code):
        raise RefusedError("a wrong code")
    return message


def signed_text(arena: str) -> str:
    return f"crcolony body 1 {arena}"


def body_request(key: SigningKey, arena: str, message: Message) -> Request:
    """A `join` without its last field, which is drawn here."""
    exchange = PrivateKey.generate()
    content = encode([*message, bytes(exchange.public_key)])
    return Request(message[4], content, seal(key, signed_text(arena), content), exchange)


def leave_request(key: SigningKey, arena: str, message: Message) -> bytes:
    return seal(key, signed_text(arena), encode(message))


def granted(request: Request, reply: bytes, arena: str, known_arena: bytes | None) -> Link | str:
    """The link, or why there is none."""
    envelope = open_envelope(reply)
    message = decode(envelope.content, BODY_BYTES, "body_granted", "body_denied")
    if message[1] != blake2b(request.content, digest_size=16).digest():
        raise RefusedError("a reply to another request")
    arena_id = id_of(envelope.key, ARENA)
    if known_arena not in (None, arena_id):
        raise RefusedError("another arena of this name")
    envelope.verify(signed_text(arena))
    if message[0] == "body_denied":
        return str(message[2])
    _, _, other_exchange_key, slot, its_run, _tick, period_s, is_lockstep, _body = message
    if its_run != request.arena_run:
        raise RefusedError("a body of another run")
    keys = agreed_keys(request.exchange, other_exchange_key, request.content, envelope.content)
    return Link(keys, arena_id, slot, its_run, period_s, is_lockstep)


class LinkedBody:
    """The two ends of a link that a robot has: it opens observations, and seals its answers to them."""

    def __init__(self, link: Link) -> None:
        self.link = link
        self.tick = -1
        self._last_action: bytes | None = None

    def observation(self, payload: bytes) -> Message | bytes | None:
        """The observation if it is a new one; its action if it is the last one, again, in lockstep; else nothing."""
        encoded = without_code(payload, self.link.keys.observations)
        message = decode(encoded, BODY_BYTES, "observation")
        _, arena_run, tick, _row, _contact = message
        if arena_run != self.link.arena_run:
            raise RefusedError("an observation of another run")
        if tick == self.tick and self.link.is_lockstep:
            return self._last_action
        if tick <= self.tick:
            return None  # a duplicate, or late
        if self.tick >= 0 and tick > self.tick + MOST_TICKS_AHEAD:
            raise RefusedError("an observation too far ahead")
        self.tick = tick
        return message

    def action(self, row: bytes) -> bytes:
        self._last_action = with_code(encode(["action", self.tick, row]), self.link.keys.actions)
        return self._last_action
