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

NONCES = 2**48
"""A nonce is smaller than this, so that a column of an observation holds it exactly."""
Nonce = Annotated[int, Meta(ge=0, lt=NONCES)]

AgentName = Annotated[str, Meta(min_length=1, max_length=64)]

Genes = Annotated[bytes, Meta(min_length=8, max_length=32_768)]
"""Little-endian float64, 8 bytes a gene."""

SchemaDigest = Annotated[bytes, Meta(min_length=16, max_length=16)]


class Encounter(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """Identifier of one meeting of two robots, unique through all crashes.

    `incarnation` is the initiator's, on its disk before it sends anything; `count` is the ordinal of its proposal.
    """

    initiator: Id
    responder: Id
    incarnation: Ordinal
    count: Ordinal

    @property
    def number(self) -> tuple[int, int]:
        """The number that increases with every proposal of the initiator."""
        return self.incarnation, self.count


class Propose(Message, frozen=True, tag="propose"):
    """The initiator offers its agent's genotype for this encounter."""

    encounter: Encounter
    nonce: Nonce
    """Random number that both bodies received at the contact: it ties the message to the meeting"""
    schema: SchemaDigest
    agent: AgentName
    genes: Genes


class Accept(Message, frozen=True, tag="accept"):
    """The responder is prepared, on disk, and sends its agent's genotype. A retry asks for the decision."""

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
    """The initiator has decided, on disk: the mating takes place."""

    encounter: Encounter


class Abort(Message, frozen=True, tag="abort"):
    """The initiator has not decided and never will: the mating does not take place."""

    encounter: Encounter


class Done(Message, frozen=True, tag="done"):
    """The responder has the mating on its disk; the initiator need not send Commit again."""

    encounter: Encounter


MatingMessage = Propose | Accept | Refuse | Commit | Abort | Done

BY_INITIATOR = (Propose, Commit, Abort)
"""The messages that the initiator sends; the responder sends the others."""


def sender_of(message: MatingMessage) -> bytes:
    """Return the id of the robot that sends this message."""
    encounter = message.encounter
    return encounter.initiator if isinstance(message, BY_INITIATOR) else encounter.responder


def receiver_of(message: MatingMessage) -> bytes:
    """Return the id of the robot that receives this message."""
    encounter = message.encounter
    return encounter.responder if isinstance(message, BY_INITIATOR) else encounter.initiator


def pack_genes(genes: FloatArray) -> bytes:
    """Return genes as little-endian float64 bytes."""
    return np.ascontiguousarray(genes, dtype="<f8").tobytes()


def unpack_genes(data: bytes, schema: Schema) -> FloatArray:
    """Return received genes, shape (genes,); raise WireError if they do not fit the schema or are not finite."""
    if len(data) != 8 * len(schema):
        raise WireError(f"{len(data)} bytes are not {len(schema)} genes")
    genes = np.frombuffer(data, dtype="<f8").astype(np.float64)
    try:
        schema.validate(genes)
    except GenotypeError as error:
        raise WireError(str(error)) from None
    return genes


decode_mating_message = StrictDecoder[MatingMessage](MatingMessage, MAX_ENVELOPE_BYTES).decode
"""Decodes the content of an envelope."""
