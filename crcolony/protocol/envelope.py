"""Signed envelopes: every mating message travels in one (PROTOCOL.md, "Envelopes")."""

from typing import Annotated

import msgspec
from msgspec import Meta

from crcolony.protocol.codec import MAX_ENVELOPE_BYTES, VERSION, StrictDecoder, WireError, encode
from crcolony.protocol.identity import (
    KEY_BYTES,
    SIGNATURE_BYTES,
    Identity,
    is_signed,
    robot_id,
)
from crcolony.protocol.mating_messages import MatingMessage, decode_mating_message, sender_of

Key = Annotated[bytes, Meta(min_length=KEY_BYTES, max_length=KEY_BYTES)]

Signature = Annotated[bytes, Meta(min_length=SIGNATURE_BYTES, max_length=SIGNATURE_BYTES)]


class SignedEnvelope(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """A signed message between robots. The signature covers the colony's name and the content, byte for byte."""

    content: Annotated[bytes, Meta(max_length=MAX_ENVELOPE_BYTES)]
    key: Key
    signature: Signature


def sign_message(message: MatingMessage, colony: str, sender: Identity) -> bytes:
    """Return the signed letter that carries a message."""
    content = encode(message)
    return encode(SignedEnvelope(content, sender.public_key, sender.sign(_signed(colony, content))))


def open_envelope(data: bytes) -> tuple[SignedEnvelope, MatingMessage]:
    """Return a letter and the message in it, whose sender the key belongs to; the signature is not verified yet.

    Everything cheap is done here, so that a letter that nobody waits for costs no verification. Raises WireError.
    """
    envelope = decode_envelope(data)
    message = decode_mating_message(envelope.content)
    if robot_id(envelope.key) != sender_of(message):
        raise WireError("the letter's key is not its sender's")
    return envelope, message


def has_valid_signature(envelope: SignedEnvelope, colony: str) -> bool:
    """Tell whether the owner of the letter's key signed it, for this colony."""
    return is_signed(_signed(colony, envelope.content), envelope.signature, envelope.key)


def _signed(colony: str, content: bytes) -> bytes:
    return b"crcolony mating %d %s\n" % (VERSION, colony.encode()) + content


decode_envelope = StrictDecoder[SignedEnvelope](SignedEnvelope, MAX_ENVELOPE_BYTES).decode
