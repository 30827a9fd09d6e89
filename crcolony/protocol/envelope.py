"""Signed envelopes, in which all messages of a mating travel (PROTOCOL.md, "Signed envelopes")."""

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
    """An encoded message with its sender's key and signature, which covers the colony's name and the content."""

    content: Annotated[bytes, Meta(max_length=MAX_ENVELOPE_BYTES)]
    key: Key
    signature: Signature


def sign_message(message: MatingMessage, colony: str, sender: Identity) -> bytes:
    """Return the encoded envelope of a message, signed by its sender."""
    content = encode(message)
    return encode(SignedEnvelope(content, sender.public_key, sender.sign(_signed(colony, content))))


def open_envelope(data: bytes) -> tuple[SignedEnvelope, MatingMessage]:
    """Return an envelope and its message; raise WireError if it is malformed or its key is not the sender's.

    The signature is not verified, so that envelopes which the robot does not expect cost little.
    """
    envelope = decode_envelope(data)
    message = decode_mating_message(envelope.content)
    if robot_id(envelope.key) != sender_of(message):
        raise WireError("the envelope's key is not its sender's")
    return envelope, message


def has_valid_signature(envelope: SignedEnvelope, colony: str) -> bool:
    """Return whether the owner of the envelope's key signed it, for this colony."""
    return is_signed(_signed(colony, envelope.content), envelope.signature, envelope.key)


def _signed(colony: str, content: bytes) -> bytes:
    return b"crcolony mating %d %s\n" % (VERSION, colony.encode()) + content


decode_envelope = StrictDecoder[SignedEnvelope](SignedEnvelope, MAX_ENVELOPE_BYTES).decode
