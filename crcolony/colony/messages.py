"""What robots, arenas and observers say to each other: MessagePack with one canonical form, and a limit on everything.

    WireError                 bytes from outside that are no message, or more than a message may be

Every message is an array that begins with its name. Decoding is strict: the right fields in the right order, every
number in its range, nothing left over, and `encode(decode(b)) == b`, so that a signature or a hash of a message means
one thing only. Whatever comes in, `decode_…` returns a message or raises WireError, nothing else. PROTOCOL.md is the
specification for strangers.
"""

from typing import Annotated, Any, Generic, Literal, TypeVar

import msgspec
import numpy as np
from msgspec import Meta

from crcolony.colony.identity import (
    ID_BYTES,
    KEY_BYTES,
    SIGNATURE_BYTES,
    Identity,
    is_signed,
    robot_id,
)
from crcolony.compiled import FloatArray
from crcolony.evolution.genotype import GenotypeError, Schema
from crcolony.world.body import ACTION_WIDTH, OBSERVATION_WIDTH

VERSION = 1
"""Of the protocol; it is part of every key, so that robots of two versions never hear each other by accident."""

LETTER_BYTES = 65_536
"""The longest letter between robots; it leaves room for 4,096 genes."""
BODY_BYTES = 4_096
"""The longest message between a robot and its body, and of one robot's telemetry."""
SCENE_BYTES = 262_144
"""The longest scene: some thousands of robots and packs."""

Id = Annotated[bytes, Meta(min_length=ID_BYTES, max_length=ID_BYTES)]
Key = Annotated[bytes, Meta(min_length=KEY_BYTES, max_length=KEY_BYTES)]
Signature = Annotated[bytes, Meta(min_length=SIGNATURE_BYTES, max_length=SIGNATURE_BYTES)]
Nonce = Annotated[int, Meta(ge=0, lt=2**48)]
Ordinal = Annotated[int, Meta(ge=0, lt=2**32)]
Tick = Annotated[int, Meta(ge=0, lt=2**53)]
AgentName = Annotated[str, Meta(min_length=1, max_length=64)]
Name = Annotated[str, Meta(pattern=r"^[A-Za-z0-9_.-]{1,64}\Z")]
"""Of a colony or an arena; it becomes part of a key expression."""
Genes = Annotated[bytes, Meta(min_length=8, max_length=32_768)]
"""Little-endian float64, one after the other; 8 bytes a gene."""
SchemaDigest = Annotated[bytes, Meta(min_length=16, max_length=16)]


class WireError(Exception):
    """Bytes from outside that are no message."""


class Message(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """A message: an array of its name and its fields."""


class Encounter(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """One meeting of two robots, named by the robot that proposes: never twice, whatever crashes.

    `life` counts the initiator's starts and is on its disk before it says anything; `count` counts its proposals in it.
    """

    initiator: Id
    responder: Id
    life: Ordinal
    count: Ordinal

    @property
    def number(self) -> tuple[int, int]:
        """What grows from one proposal of the initiator to its next."""
        return self.life, self.count


class Propose(Message, frozen=True, tag="propose"):
    """The initiator offers its agent's genotype for this encounter."""

    encounter: Encounter
    nonce: Nonce
    """What both bodies were told at the contact: it ties the letter to the meeting"""
    schema: SchemaDigest
    agent: AgentName
    genes: Genes


class Accept(Message, frozen=True, tag="accept"):
    """The responder is prepared, on disk, and gives its agent's genotype. Said again, it asks what was decided."""

    encounter: Encounter
    nonce: Nonce
    schema: SchemaDigest
    agent: AgentName
    genes: Genes


class Refuse(Message, frozen=True, tag="refuse"):
    """The responder is not prepared for this encounter; a `stale` one may have ended long ago, either way."""

    encounter: Encounter
    reason: Literal["busy", "schema", "stale", "storage"]


class Commit(Message, frozen=True, tag="commit"):
    """The initiator has decided, on disk: this mating takes place."""

    encounter: Encounter


class Abort(Message, frozen=True, tag="abort"):
    """The initiator has decided, or never knew better: this mating does not take place."""

    encounter: Encounter


class Done(Message, frozen=True, tag="done"):
    """The responder has this mating on its disk; the initiator need not say so again."""

    encounter: Encounter


Mating = Propose | Accept | Refuse | Commit | Abort | Done
BY_INITIATOR = (Propose, Commit, Abort)


def sender_of(message: Mating) -> bytes:
    """Return the id of the robot that must have said this."""
    encounter = message.encounter
    return encounter.initiator if isinstance(message, BY_INITIATOR) else encounter.responder


def receiver_of(message: Mating) -> bytes:
    """Return the id of the robot that this is said to."""
    encounter = message.encounter
    return encounter.responder if isinstance(message, BY_INITIATOR) else encounter.initiator


class Letter(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """A signed message between robots. The signature covers the colony's name and the content, byte for byte."""

    content: Annotated[bytes, Meta(max_length=LETTER_BYTES)]
    key: Key
    signature: Signature


def seal(message: Mating, colony: str, sender: Identity) -> bytes:
    """Return the signed letter that carries a message."""
    content = encode(message)
    return encode(Letter(content, sender.public_key, sender.sign(_signed(colony, content))))


def open_letter(data: bytes) -> tuple[Letter, Mating]:
    """Return a letter and the message in it, whose sender the key belongs to; the signature is not verified yet.

    Everything cheap is done here, so that a letter that nobody waits for costs no verification. Raises WireError.
    """
    letter = decode_letter(data)
    message = decode_mating(letter.content)
    if robot_id(letter.key) != sender_of(message):
        raise WireError("the letter's key is not its sender's")
    return letter, message


def is_genuine(letter: Letter, colony: str) -> bool:
    """Tell whether the owner of the letter's key signed it, for this colony."""
    return is_signed(_signed(colony, letter.content), letter.signature, letter.key)


def _signed(colony: str, content: bytes) -> bytes:
    return b"crcolony mating %d %s\n" % (VERSION, colony.encode()) + content


def pack_genes(genes: FloatArray) -> bytes:
    """Return genes as they travel: little-endian float64."""
    return np.ascontiguousarray(genes, dtype="<f8").tobytes()


def unpack_genes(data: bytes, schema: Schema) -> FloatArray:
    """Return received genes, shape (genes,); raises WireError if they are not finite, in range, and of this schema."""
    if len(data) != 8 * len(schema):
        raise WireError(f"{len(data)} bytes are not {len(schema)} genes")
    genes = np.frombuffer(data, dtype="<f8").astype(np.float64)
    try:
        schema.validate(genes)
    except GenotypeError as error:
        raise WireError(str(error)) from None
    return genes


# Between a robot and its body ---------------------------------------------------------------------------------------

Observed = Annotated[
    bytes, Meta(min_length=8 * OBSERVATION_WIDTH, max_length=8 * OBSERVATION_WIDTH)
]
Acted = Annotated[bytes, Meta(min_length=8 * ACTION_WIDTH, max_length=8 * ACTION_WIDTH)]


class Join(Message, frozen=True, tag="join"):
    """A robot asks an arena for a body."""

    robot: Id
    colony: Name
    number: Annotated[int, Meta(ge=-1, lt=2**31)]
    """The place it would like, or -1 for any"""


class Embodied(Message, frozen=True, tag="embodied"):
    """The arena's answer: this is your body."""

    place: Annotated[int, Meta(ge=0, lt=2**31)]
    world: Annotated[int, Meta(ge=0, lt=2**62)]
    """Names this run of the arena; its ticks are comparable with no other's"""
    tick: Tick
    period_s: Annotated[float, Meta(gt=0.0, le=1e4)]
    lockstep: bool
    """Whether the arena waits for this robot's action"""
    body: Annotated[str, Meta(max_length=BODY_BYTES)]
    """What the body can do: the settings of `[body]` as JSON"""


class Refused(Message, frozen=True, tag="refused"):
    """The arena's answer: no body for you."""

    reason: Annotated[str, Meta(max_length=200)]


class Leave(Message, frozen=True, tag="leave"):
    """A robot gives its body back."""

    robot: Id


class Contact(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """Two robots face each other within infrared range, both ready to mate."""

    robot: Id
    nonce: Nonce


class Observation(Message, frozen=True, tag="observation"):
    """What a body senses in one control period; its columns are those of `world.body.OBSERVATION`."""

    world: Annotated[int, Meta(ge=0, lt=2**62)]
    tick: Tick
    row: Observed
    contact: Contact | None


class Action(Message, frozen=True, tag="action"):
    """What a robot commands; its columns are those of `world.body.ACTION`. `tick` is the observation it answers."""

    tick: Tick
    row: Acted


def pack_row(row: FloatArray) -> bytes:
    """Return an observation or an action as it travels: little-endian float64."""
    return np.ascontiguousarray(row, dtype="<f8").tobytes()


def unpack_row(data: bytes) -> FloatArray:
    """Return a received observation or action; raises WireError for a number that is not finite."""
    row = np.frombuffer(data, dtype="<f8").astype(np.float64)
    if not np.isfinite(row).all():
        raise WireError("a number is not finite")
    return row


# Encoding and decoding ----------------------------------------------------------------------------------------------

_encoder = msgspec.msgpack.Encoder()


def encode(message: Any) -> bytes:
    """Return a message's canonical bytes."""
    return _encoder.encode(message)


T = TypeVar("T")


class Door(Generic[T]):
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


decode_letter = Door[Letter](Letter, LETTER_BYTES).decode
decode_mating = Door[Mating](Mating, LETTER_BYTES).decode
"""Of the content of a letter"""
decode_join = Door[Join | Leave](Join | Leave, BODY_BYTES).decode
decode_place = Door[Embodied | Refused](Embodied | Refused, BODY_BYTES).decode
decode_observation = Door[Observation](Observation, BODY_BYTES).decode
decode_action = Door[Action](Action, BODY_BYTES).decode
