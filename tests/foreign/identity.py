"""A robot's key and its signed envelopes (PROTOCOL.md, "Identity", "Signed envelopes")."""

import os
from hashlib import blake2b
from pathlib import Path
from typing import Final, NamedTuple

from nacl.exceptions import BadSignatureError
from nacl.signing import SigningKey, VerifyKey

from tests.foreign.messages import ENVELOPE_BYTES, RefusedError, encode, unpack

ROBOT: Final = b"crcolony robot\0\0"
ARENA: Final = b"crcolony arena\0\0"


class Envelope(NamedTuple):
    """What was said, by which key; the signature is not yet verified."""

    content: bytes
    key: bytes
    signature: bytes

    def verify(self, text: str) -> None:
        """`text` says what the signature is for: a mating or a body, the version, the colony or the arena.

        libsodium refuses keys of small order and a signature whose S is not below the group's order."""
        try:
            VerifyKey(self.key).verify(text.encode() + b"\n" + self.content, self.signature)
        except BadSignatureError:
            raise RefusedError("a wrong signature") from None


def id_of(key: bytes, personalisation: bytes = ROBOT) -> bytes:
    return blake2b(key, digest_size=16, person=personalisation).digest()


def seal(key: SigningKey, text: str, content: bytes) -> bytes:
    signature = key.sign(text.encode() + b"\n" + content).signature
    return encode([content, bytes(key.verify_key), signature])


def open_envelope(payload: bytes) -> Envelope:
    match unpack(payload, ENVELOPE_BYTES):
        case [bytes(content), bytes(key), bytes(signature)] if (
            len(key) == 32 and len(signature) == 64
        ):
            return Envelope(content, key, signature)
    raise RefusedError("no envelope")


def stored_key(path: Path) -> SigningKey:
    """The key of this file, which is made if there is none."""
    if not path.exists():
        part = path.with_suffix(".part")
        with open(os.open(part, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "w") as file:
            file.write(bytes(SigningKey.generate()).hex() + "\n")
            file.flush()
            os.fsync(file.fileno())
        part.rename(path)
    return SigningKey(bytes.fromhex(path.read_text().strip()))
