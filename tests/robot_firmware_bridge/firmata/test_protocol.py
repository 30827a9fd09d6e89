"""The bytes of Firmata: those of its description, and a reader that nothing can upset."""

import itertools

import pytest
from crcolony_bridge.firmata import protocol
from crcolony_bridge.firmata.protocol import (
    MAX_SYSEX_BYTES,
    AnalogMapping,
    AnalogValue,
    Capabilities,
    FirmataReader,
    Firmware,
    Message,
    PinMode,
    PinState,
    Version,
)
from hypothesis import given
from hypothesis import strategies as st

SENT: dict[Message, bytes] = {
    Version(2, 4): b"\xf9\x02\x04",
    Firmware(2, 4, "Std"): b"\xf0\x79\x02\x04S\0t\0d\0\xf7",
    Firmware(2, 4, "ß?"): b"\xf0\x79\x02\x04\x5f\x01\x0a\0\xf7",
    Capabilities(
        (frozenset(), frozenset({0, 1, 3}))
    ): b"\xf0\x6c\x7f\x00\x01\x01\x01\x03\x08\x7f\xf7",
    AnalogMapping((None, 0, 1)): b"\xf0\x6a\x7f\x00\x01\xf7",
    PinState(3, PinMode.PWM, 228): b"\xf0\x6e\x03\x03\x64\x01\xf7",
    PinState(12, PinMode.OUTPUT, 1): b"\xf0\x6e\x0c\x01\x01\xf7",
    AnalogValue(1, 511): b"\xe1\x7f\x03",
}
"""What StandardFirmata answers."""


def test_messages_are_the_bytes_of_the_protocol() -> None:
    """Levels in parts of seven bits; a pin beyond 15 takes a longer message."""
    assert protocol.set_pin_mode(3, PinMode.PWM) == b"\xf4\x03\x03"
    assert protocol.write_pwm(3, 228) == b"\xe3\x64\x01"
    assert protocol.write_pwm(45, 255) == b"\xf0\x6f\x2d\x7f\x01\xf7"
    assert protocol.write_port(1, 0b1011_0000) == b"\x91\x30\x01"
    assert protocol.query_pin(12) == b"\xf0\x6d\x0c\xf7"
    assert protocol.report_analog(5) == b"\xc5\x01"
    assert protocol.sampling_interval(200) == b"\xf0\x7a\x48\x01\xf7"


@pytest.mark.parametrize("message", SENT, ids=lambda message: type(message).__name__)
def test_answers_are_understood_in_any_pieces(message: Message) -> None:
    """Also one byte at a time."""
    reader = FirmataReader()
    found = [found for byte in SENT[message] for found in reader.feed(bytes((byte,)))]
    assert found == [message]


@given(st.lists(st.one_of(st.binary(max_size=40), st.sampled_from(list(SENT.values())))))
def test_a_reader_takes_any_bytes(pieces: list[bytes]) -> None:
    """It raises nothing, keeps little, and understands the next message after any of them."""
    reader = FirmataReader()
    for piece in pieces:
        reader.feed(piece)
    assert reader.feed(b"\xff" + b"".join(SENT.values())) == list(SENT)


@given(st.lists(st.sampled_from(list(SENT.items())), max_size=8), st.data())
def test_the_pieces_in_which_bytes_arrive_do_not_matter(
    sent: list[tuple[Message, bytes]], data: st.DataObject
) -> None:
    """As they do not on any serial line."""
    stream = b"".join(piece for _, piece in sent)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=5)))
    reader = FirmataReader()
    found: list[Message] = []
    for start, end in itertools.pairwise([0, *cuts, len(stream)]):
        found += reader.feed(stream[start:end])
    assert found == [message for message, _ in sent]


def test_a_message_without_an_end_takes_no_memory() -> None:
    """More than the longest one is dropped."""
    reader = FirmataReader()
    for _ in range(100):
        assert reader.feed(b"\xf0" + bytes(MAX_SYSEX_BYTES)) == []
        assert len(reader._pending) <= MAX_SYSEX_BYTES + 1
    assert reader.feed(bytes(100) + b"\xf7" + SENT[Version(2, 4)]) == [Version(2, 4)]


def test_a_message_that_another_one_breaks_off_is_none() -> None:
    """Bytes were lost between."""
    assert FirmataReader().feed(b"\xf0\x6e\x03\x03\xe1\x7f\x03\xf7") == [AnalogValue(1, 511)]
