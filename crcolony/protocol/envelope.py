"""The signed envelopes in which all messages of a mating travel."""

from crcolony.protocol.codec import WireError, encode
from crcolony.protocol.identity import Identity, robot_id
from crcolony.protocol.mating_messages import MatingMessage, decode_mating_message, sender_of
from crcolony.protocol.signed_envelope import (
    SignedEnvelope,
    decode_envelope,
    is_valid,
    sign_content,
)


def sign_message(message: MatingMessage, colony: str, sender: Identity) -> bytes:
    """Return the encoded envelope of a message, signed by its sender for a colony."""
    return sign_content(encode(message), f"mating {colony}", sender)


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
    return is_valid(envelope, f"mating {colony}")
