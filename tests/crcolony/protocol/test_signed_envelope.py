"""A signed envelope is valid for one purpose, byte for byte."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from crcolony.protocol.codec import WireError
from crcolony.protocol.identity import is_signed, seeded
from crcolony.protocol.signed_envelope import decode_envelope, is_valid, sign_content

SENDER = seeded("test", 1, 0)


def test_the_signature_covers_purpose_and_content() -> None:
    """The text is that of PROTOCOL.md, so that any language can make one."""
    envelope = decode_envelope(sign_content(b"content", "body lab", SENDER))
    assert (envelope.content, envelope.key) == (b"content", SENDER.public_key)
    text = b"crcolony body 1 lab\ncontent"
    assert is_signed(text, envelope.signature, SENDER.public_key)


@given(st.sampled_from(["mating", "body"]), st.from_regex(r"[A-Za-z0-9_.-]{1,8}", fullmatch=True))
def test_it_is_valid_for_its_purpose_alone(kind: str, name: str) -> None:
    """Neither for another kind nor for another name."""
    envelope = decode_envelope(sign_content(b"content", f"{kind} {name}", SENDER))
    assert is_valid(envelope, f"{kind} {name}")
    assert not is_valid(envelope, f"{kind} {name}.")
    assert not is_valid(envelope, f"state {name}")


def test_what_is_no_envelope_is_refused() -> None:
    """Whoever sends it."""
    with pytest.raises(WireError):
        decode_envelope(b"noise")
