"""Bytes are the message that a beacon has sent, or nothing."""

from crcolony_bridge.infrared.beacon import BeaconMessage
from crcolony_bridge.infrared.ir_messages import seal
from crcolony_bridge.infrared.whole_beacon import (
    FORM,
    WholeEncoding,
    decode_beacon,
    encode_beacon,
)
from hypothesis import given
from hypothesis import strategies as st

A = bytes([1]) * 16
TOKENS = st.binary(min_size=FORM.token_bytes, max_size=FORM.token_bytes).filter(any)


@given(TOKENS, st.one_of(st.just(b""), TOKENS), st.binary(max_size=400))
def test_a_message_arrives_as_it_was_sent(token: bytes, heard: bytes, envelope: bytes) -> None:
    """With its envelope, from a robot on the network or not."""
    message = BeaconMessage(A, token, heard, envelope)
    encoding = WholeEncoding()
    assert encoding.decode(0.0, [encoding.encode(0.0, message)], ()) == [message]


@given(st.binary(max_size=64))
def test_whatever_emits_infrared_does_no_harm(data: bytes) -> None:
    """Bytes are a message of a beacon, or nothing."""
    message = decode_beacon(data)
    assert message is None or encode_beacon(message) == data


def test_a_message_fits_into_one_fragment() -> None:
    """With its digest: most robots are in sight of each other only for a moment."""
    assert len(seal(encode_beacon(BeaconMessage(A, bytes(FORM.token_bytes))))) <= 48
