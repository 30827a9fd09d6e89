"""What a robot tells observers is followed by a count, its key, and a signature that covers all of it."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from crcolony.protocol.codec import WireError
from crcolony.protocol.identity import is_signed, seeded
from crcolony.protocol.signed_telemetry import (
    TRAILER_BYTES,
    open_telemetry,
    purpose_of_arena,
    purpose_of_robot,
    sign_telemetry,
)

SENDER = seeded("test", 1, 0)


def test_the_trailer_is_that_of_the_page() -> None:
    """Count, key and signature, so that any language can make one."""
    data = sign_telemetry(b"content", purpose_of_robot("blue"), SENDER, 2**40 + 1)
    assert len(data) == len(b"content") + TRAILER_BYTES
    count = (2**40 + 1).to_bytes(8, "big")
    assert data[:-64] == b"content" + count + SENDER.public_key
    text = b"crcolony telemetry 1 blue\ncontent" + count
    assert is_signed(text, data[-64:], SENDER.public_key)


@given(st.binary(min_size=1, max_size=300), st.integers(0, 2**64 - 1), st.data())
def test_no_bit_can_be_changed(content: bytes, count: int, data: st.DataObject) -> None:
    """Neither of the message nor of what stands behind it; nor is it valid for anything else."""
    signed = sign_telemetry(content, purpose_of_robot("blue"), SENDER, count)
    opened = open_telemetry(signed)
    assert (opened.content, opened.count, opened.key) == (content, count, SENDER.public_key)
    assert opened.is_valid(purpose_of_robot("blue"))
    assert not opened.is_valid(purpose_of_robot("red"))
    assert not opened.is_valid(purpose_of_arena("blue"))
    bit = data.draw(st.integers(0, 8 * len(signed) - 1))
    changed = bytearray(signed)
    changed[bit // 8] ^= 1 << bit % 8
    assert not open_telemetry(bytes(changed)).is_valid(purpose_of_robot("blue"))


def test_what_is_too_short_is_not_signed() -> None:
    """A message needs at least a byte before the trailer."""
    for size in (0, 7, TRAILER_BYTES):
        with pytest.raises(WireError, match="not signed"):
            open_telemetry(bytes(size))
