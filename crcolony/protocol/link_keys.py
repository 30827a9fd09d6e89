"""The secret keys of the link between a robot and its body, and the codes that all its messages carry.

Both ends draw a key of X25519 (RFC 7748) for one link. What they have in common, and nobody else can know, is hashed
with everything that both have signed. So a message with a valid code comes from the other end, whatever the network is.
"""

import hashlib
import hmac
from dataclasses import dataclass

from nacl import bindings

from crcolony.protocol.codec import WireError

EXCHANGE_KEY_BYTES = 32
CODE_BYTES = 16
_KEY_BYTES = 32
_PERSON = b"crcolony body"


@dataclass(frozen=True)
class LinkKeys:
    """The keys of one link: one for each direction, so that no message can be sent back."""

    observations: bytes
    actions: bytes


class ExchangeKey:
    """A key pair that one end draws for one link; `secret` are 32 random bytes."""

    def __init__(self, secret: bytes) -> None:
        self.public: bytes = bindings.crypto_scalarmult_base(secret)
        self._secret = secret

    def agree(self, public: bytes, transcript: bytes) -> LinkKeys:
        """Return the keys of the link to the owner of `public`; raises WireError if that is no key.

        `transcript` is what both ends have signed.
        """
        try:
            shared = bindings.crypto_scalarmult(self._secret, public)
        except (
            RuntimeError
        ):  # a point of small order: both ends would have the same keys with anybody
            raise WireError("not a key of X25519") from None
        material = hashlib.blake2b(transcript, key=shared, person=_PERSON).digest()
        return LinkKeys(material[:_KEY_BYTES], material[_KEY_BYTES:])


def seal(key: bytes, content: bytes) -> bytes:
    """Return a message followed by its code."""
    return content + _code(key, content)


def open_sealed(key: bytes, data: bytes) -> bytes:
    """Return the message before its code; raises WireError if the code is not that of this key."""
    content = data[:-CODE_BYTES]
    if not hmac.compare_digest(_code(key, content), data[-CODE_BYTES:]):
        raise WireError("its code is not valid")
    return content


def _code(key: bytes, content: bytes) -> bytes:
    return hashlib.blake2b(content, digest_size=CODE_BYTES, key=key).digest()
