"""The messages between a robot and its body (PROTOCOL.md, "Between a robot and its body")."""

from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta

from crcolony.body.contract import ACTION_WIDTH, OBSERVATION_WIDTH
from crcolony.compiled import FloatArray
from crcolony.protocol.codec import (
    MAX_BODY_MESSAGE_BYTES,
    ArenaRun,
    Id,
    Message,
    Name,
    Ordinal,
    StrictDecoder,
    Tick,
    WireError,
)
from crcolony.protocol.link_keys import EXCHANGE_KEY_BYTES
from crcolony.protocol.mating_messages import Nonce

DIGEST_BYTES = 16
"""Of the digest of a request"""

ObservationRow = Annotated[
    bytes, Meta(min_length=8 * OBSERVATION_WIDTH, max_length=8 * OBSERVATION_WIDTH)
]

ActionRow = Annotated[bytes, Meta(min_length=8 * ACTION_WIDTH, max_length=8 * ACTION_WIDTH)]


ExchangeKey = Annotated[bytes, Meta(min_length=EXCHANGE_KEY_BYTES, max_length=EXCHANGE_KEY_BYTES)]
Digest = Annotated[bytes, Meta(min_length=DIGEST_BYTES, max_length=DIGEST_BYTES)]


class Join(Message, frozen=True, tag="join"):
    """Request of a robot for a body."""

    robot: Id
    colony: Name
    slot: Annotated[int, Meta(ge=-1, lt=2**31)]
    """The slot it prefers, -1 for any"""
    arena_run: ArenaRun
    """The run that is to answer"""
    incarnation: Ordinal
    count: Tick
    """Of its requests in this incarnation: an older one is never carried out"""
    exchange_key: ExchangeKey
    """Drawn for this link"""


class BodyGranted(Message, frozen=True, tag="body_granted"):
    """Reply of the arena: the robot has a body."""

    request: Digest
    """Of the request"""
    exchange_key: ExchangeKey
    """Drawn for this link"""
    slot: Annotated[int, Meta(ge=0, lt=2**31)]
    arena_run: ArenaRun
    """Identifies this run of the arena; ticks of two runs cannot be compared"""
    tick: Tick
    period_s: Annotated[float, Meta(gt=0.0, le=1e4)]
    lockstep: bool
    """Whether the arena waits for this robot's action"""
    body: Annotated[str, Meta(max_length=MAX_BODY_MESSAGE_BYTES)]
    """The body's settings, the group `[body]` as JSON"""


class BodyDenied(Message, frozen=True, tag="body_denied"):
    """Reply of the arena: the robot gets no body."""

    request: Digest
    reason: Annotated[str, Meta(max_length=200)]


class Leave(Message, frozen=True, tag="leave"):
    """A robot gives its body back."""

    robot: Id
    arena_run: ArenaRun
    incarnation: Ordinal
    count: Tick


class Contact(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """Two robots face each other within infrared range, both ready to mate."""

    robot: Id
    nonce: Nonce


class Observation(Message, frozen=True, tag="observation"):
    """What a body senses in one control period; its columns are those of `body.contract.OBSERVATION`."""

    arena_run: ArenaRun
    tick: Tick
    row: ObservationRow
    contact: Contact | None


class Action(Message, frozen=True, tag="action"):
    """What a robot commands; its columns are those of `body.contract.ACTION`. `tick` is the observation it answers."""

    tick: Tick
    row: ActionRow


class LocalLink(Message, frozen=True, tag="local_link"):
    """What both ends of a link on one machine prove before they share memory."""

    robot: Id
    arena_run: ArenaRun
    challenge: Digest
    """Drawn by the body's process"""


def pack_row(row: FloatArray) -> bytes:
    """Return an observation or an action as little-endian float64 bytes."""
    return np.ascontiguousarray(row, dtype="<f8").tobytes()


def unpack_row(data: bytes) -> FloatArray:
    """Return a received observation or action, shape (columns,); raise WireError if a number is not finite."""
    row = np.frombuffer(data, dtype="<f8").astype(np.float64)
    if not np.isfinite(row).all():
        raise WireError("a number is not finite")
    return row


decode_join = StrictDecoder[Join | Leave](Join | Leave, MAX_BODY_MESSAGE_BYTES).decode

decode_join_reply = StrictDecoder[BodyGranted | BodyDenied](
    BodyGranted | BodyDenied, MAX_BODY_MESSAGE_BYTES
).decode

decode_observation = StrictDecoder[Observation](Observation, MAX_BODY_MESSAGE_BYTES).decode

decode_action = StrictDecoder[Action](Action, MAX_BODY_MESSAGE_BYTES).decode

decode_local_link = StrictDecoder[LocalLink](LocalLink, MAX_BODY_MESSAGE_BYTES).decode
