"""A message with its sender's key and signature (PROTOCOL.md, "Signed envelopes")."""

from typing import Annotated

import msgspec
from msgspec import Meta

from crcolony.protocol.codec import MAX_ENVELOPE_BYTES, VERSION, StrictDecoder, encode
from crcolony.protocol.identity import KEY_BYTES, SIGNATURE_BYTES, Identity, is_signed

Key = Annotated[bytes, Meta(min_length=KEY_BYTES, max_length=KEY_BYTES)]
Signature = Annotated[bytes, Meta(min_length=SIGNATURE_BYTES, max_length=SIGNATURE_BYTES)]


class SignedEnvelope(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """An encoded message with its sender's key, and a signature that covers a purpose and the content."""

    content: Annotated[bytes, Meta(max_length=MAX_ENVELOPE_BYTES)]
    key: Key
    signature: Signature


def sign_content(content: bytes, purpose: str, sender: Identity) -> bytes:
    """Return the encoded envelope of an encoded message; it is valid for this purpose alone."""
    signature = sender.sign(signed_text(content, purpose))
    return encode(SignedEnvelope(content, sender.public_key, signature))


def is_valid(envelope: SignedEnvelope, purpose: str) -> bool:
    """Return whether the owner of the envelope's key signed it for this purpose."""
    return is_signed(signed_text(envelope.content, purpose), envelope.signature, envelope.key)


def signed_text(content: bytes, purpose: str) -> bytes:
    """Return what a signature covers: the purpose is a kind of message and a name, and the version is part of it."""
    kind, _, name = purpose.partition(" ")
    return b"crcolony %s %d %s\n" % (kind.encode(), VERSION, name.encode()) + content


decode_envelope = StrictDecoder[SignedEnvelope](SignedEnvelope, MAX_ENVELOPE_BYTES).decode
