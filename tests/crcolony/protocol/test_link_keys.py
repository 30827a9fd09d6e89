"""Both ends of a link, and nobody else, have its keys; nothing can be changed, or be sent back."""

import hashlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from crcolony.protocol.codec import WireError
from crcolony.protocol.link_keys import CODE_BYTES, ExchangeKey, open_sealed, seal

SECRETS = st.binary(min_size=32, max_size=32)


def test_the_exchange_is_that_of_rfc_7748() -> None:
    """By its example (6.1): both public keys, and the secret in common as the key of the digest."""
    alice = ExchangeKey(
        bytes.fromhex("77076d0a7318a57d3c16c17251b26645df4c2f87ebc0992ab177fba51db92c2a")
    )
    bob = ExchangeKey(
        bytes.fromhex("5dab087e624a8a4b79e17f8b83800ee66f3bb1292618b6fd1c2f8b27ff88e0eb")
    )
    assert alice.public.hex().startswith("8520f0098930a754748b7ddcb43ef75a")
    assert bob.public.hex().startswith("de9edb7d7b7dc1b4d35b61c2ece43537")
    shared = bytes.fromhex("4a5d9d5ba4ce2de1728e3bf480350f25e07e21c947d19e3376f09b3c1e161742")
    digest = hashlib.blake2b(b"said", key=shared, person=b"crcolony body").digest()
    keys = alice.agree(bob.public, b"said")
    assert (keys.observations, keys.actions) == (digest[:32], digest[32:])


@given(SECRETS, SECRETS, SECRETS, st.binary())
def test_both_ends_have_the_same_keys_and_others_have_not(
    one: bytes, other: bytes, third: bytes, said: bytes
) -> None:
    """The keys of the two directions differ; with another transcript, or another end, all are others."""
    first, second = ExchangeKey(one), ExchangeKey(other)
    keys = first.agree(second.public, said)
    assert keys == second.agree(first.public, said)
    assert keys.observations != keys.actions
    assert keys != first.agree(second.public, said + b"!")
    stranger = ExchangeKey(third)
    if stranger.public not in (first.public, second.public):
        assert keys != stranger.agree(first.public, said)
        assert keys != stranger.agree(second.public, said)


@pytest.mark.parametrize("point", [bytes(32), b"\x01" + bytes(31)])
def test_a_key_that_would_make_the_secret_public_is_refused(point: bytes) -> None:
    """A point of small order: whoever sends it knows the result."""
    with pytest.raises(WireError, match="not a key of X25519"):
        ExchangeKey(bytes(range(32))).agree(point, b"")


def test_a_code_is_blake2b_with_the_key() -> None:
    """As PROTOCOL.md says it, so that any language can make one."""
    key, content = bytes(range(32)), b"content"
    expected = hashlib.blake2b(content, digest_size=16, key=key).digest()
    assert seal(key, content) == content + expected


@given(SECRETS, st.binary(max_size=400), st.data())
def test_no_bit_of_a_sealed_message_can_be_changed(
    key: bytes, content: bytes, data: st.DataObject
) -> None:
    """Nor can it be shortened, or opened with another key."""
    sealed = seal(key, content)
    assert open_sealed(key, sealed) == content
    bit = data.draw(st.integers(0, 8 * len(sealed) - 1))
    changed = bytearray(sealed)
    changed[bit // 8] ^= 1 << bit % 8
    for forged in (bytes(changed), sealed[:-1], sealed + b"0", sealed[-CODE_BYTES:], b""):
        if forged != sealed:
            with pytest.raises(WireError, match="its code is not valid"):
                open_sealed(key, forged)
