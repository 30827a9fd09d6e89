"""The messages of a mating (PROTOCOL.md, "Mating messages")."""

from typing import Annotated, Literal

import msgspec
import numpy as np
from msgspec import Meta

from crcolony.compiled import FloatArray
from crcolony.evolution.genotype import GenotypeError, Schema
from crcolony.protocol.codec import (
    MAX_ENVELOPE_BYTES,
    Id,
    Message,
    Ordinal,
    StrictDecoder,
    WireError,
)

Nonce = Annotated[int, Meta(ge=0, lt=2**48)]

AgentName = Annotated[str, Meta(min_length=1, max_length=64)]

Genes = Annotated[bytes, Meta(min_length=8, max_length=32_768)]
"""Little-endian float64, one after the other; 8 bytes a gene."""

SchemaDigest = Annotated[bytes, Meta(min_length=16, max_length=16)]


class Encounter(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """One meeting of two robots, named by the robot that proposes: never twice, whatever crashes.

    `life` counts the initiator's starts and is on its disk before it says anything; `count` counts its proposals in it.
    """

    initiator: Id
    responder: Id
    incarnation: Ordinal
    count: Ordinal

    @property
    def number(self) -> tuple[int, int]:
        """What grows from one proposal of the initiator to its next."""
        return self.incarnation, self.count


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


MatingMessage = Propose | Accept | Refuse | Commit | Abort | Done

BY_INITIATOR = (Propose, Commit, Abort)


def sender_of(message: MatingMessage) -> bytes:
    """Return the id of the robot that must have said this."""
    encounter = message.encounter
    return encounter.initiator if isinstance(message, BY_INITIATOR) else encounter.responder


def receiver_of(message: MatingMessage) -> bytes:
    """Return the id of the robot that this is said to."""
    encounter = message.encounter
    return encounter.responder if isinstance(message, BY_INITIATOR) else encounter.initiator


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


decode_mating_message = StrictDecoder[MatingMessage](MatingMessage, MAX_ENVELOPE_BYTES).decode
"""Of the content of a letter"""
