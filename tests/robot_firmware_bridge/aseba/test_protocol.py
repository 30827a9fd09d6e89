"""Aseba's messages survive any split of their stream, and what is no message is an AsebaError and nothing else."""

from contextlib import suppress

import pytest
from crcolony_bridge.aseba.protocol import (
    MAX_EVENT_WORDS,
    AsebaError,
    AsebaMessage,
    AsebaReader,
    AsebaType,
    encode_message,
    parse_description,
    request,
)
from hypothesis import given
from hypothesis import strategies as st

from tests.robot_firmware_bridge.aseba.nodes import E_PUCK_NODE, Node

MESSAGES = st.builds(
    AsebaMessage,
    st.integers(0, 0xFFFF),
    st.binary(max_size=2 * MAX_EVENT_WORDS),
    st.integers(0, 0xFFFF),
)


def test_a_request_has_aseba_s_bytes() -> None:
    """Length without the header, source, type and words, all little-endian; negative words as two's complement."""
    data = encode_message(request(AsebaType.SET_VARIABLES, 1, 35, -2))
    assert data == bytes.fromhex("0600 0000 0ca0 0100 2300 feff")


@given(st.lists(MESSAGES, max_size=6), st.data())
def test_any_split_of_a_stream_gives_the_same_messages(
    sent: list[AsebaMessage], data: st.DataObject
) -> None:
    """Byte by byte, or many messages at once."""
    stream = b"".join(map(encode_message, sent))
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=12)))
    reader, received = AsebaReader(), []
    for start, end in zip([0, *cuts], [*cuts, len(stream)], strict=True):
        received += reader.feed(stream[start:end])
    assert received == sent


@given(st.lists(st.binary(max_size=600), max_size=8))
def test_garbage_is_an_aseba_error_or_messages(pieces: list[bytes]) -> None:
    """Nothing else is raised, and no more is kept than one message."""
    reader = AsebaReader()
    for piece in pieces:
        try:
            for message in reader.feed(piece):
                assert len(message.payload) <= 2 * MAX_EVENT_WORDS
        except AsebaError:
            return


@given(st.sampled_from(list(AsebaType)), st.binary(max_size=64))
def test_a_description_of_garbage_is_an_aseba_error_or_a_description(
    type_: AsebaType, payload: bytes
) -> None:
    """The first message of it, and those that follow."""
    message = AsebaMessage(type_, payload)
    with suppress(AsebaError):
        parse_description(message)
    with suppress(AsebaError):
        E_PUCK_NODE.described.add(message)


def test_a_description_gives_addresses_and_numbers_of_events() -> None:
    """Variables follow each other in the order in which they are named; events count downwards."""
    node = E_PUCK_NODE.described
    assert node.is_complete
    assert node.name == "e-puck0"
    assert node.address("speed.left") == 34
    assert node.address("prox", 8) == 39
    assert node.first_free_word == 228
    assert node.event("ir_sensors") == 0xFFFE
    assert node.event("camera") == 0xFFFD
    with pytest.raises(AsebaError, match="no variable prox of 9 words"):
        node.address("prox", 9)
    with pytest.raises(AsebaError, match="no event tea"):
        node.event("tea")


def test_a_description_is_complete_with_its_last_part() -> None:
    """Not before."""
    first, *others = E_PUCK_NODE.messages
    node = parse_description(first)
    for message in others:
        assert not node.is_complete
        node.add(message)
    assert node.is_complete


def test_another_version_of_the_protocol_is_refused() -> None:
    """It is said which one it is."""
    with pytest.raises(AsebaError, match="version 4"):
        parse_description(Node("old", {}, (), version=4).messages[0])
