"""Frames are coded alike in Python and in C, and what is no frame is counted and does no harm."""

import binascii
import json

import pytest
from cobs import cobs  # type: ignore[import-untyped]
from crcolony_bridge.reference_firmware import messages
from crcolony_bridge.reference_firmware.frames import (
    MAX_PAYLOAD_BYTES,
    Frame,
    FrameError,
    FrameReader,
    decode_frame,
    encode_frame,
)
from hypothesis import given
from hypothesis import strategies as st

from tests.robot_firmware_bridge.firmware import HostRobot, needs_compiler
from tests.support.paths import ROOT

VECTORS = json.loads((ROOT / "tests" / "vectors" / "firmware_frames.json").read_text())
FRAMES = st.builds(
    Frame,
    type=st.integers(0, 255),
    seq=st.integers(0, 65535),
    payload=st.binary(max_size=MAX_PAYLOAD_BYTES),
    flags=st.integers(0, 15),
)


@pytest.mark.parametrize("vector", VECTORS, ids=lambda vector: str(vector["name"]))
def test_a_frame_has_the_bytes_of_the_golden_vectors(vector: dict[str, object]) -> None:
    """In both directions."""
    frame = Frame(
        int(str(vector["type"])), int(str(vector["seq"])), bytes.fromhex(str(vector["payload"]))
    )
    encoded = bytes.fromhex(str(vector["encoded"]))
    assert encode_frame(frame) == encoded
    assert decode_frame(encoded[:-1]) == frame


@needs_compiler
@pytest.mark.parametrize(
    "vector",
    [v for v in VECTORS if v["type"] == messages.MessageType.PING],
    ids=lambda v: str(v["name"]),
)
def test_the_firmware_reads_and_writes_the_golden_vectors(vector: dict[str, object]) -> None:
    """A ping of the vectors is answered with its payload; the answer's bytes are those that Python writes."""
    robot = HostRobot()
    robot.sent()
    robot.receive(bytes.fromhex(str(vector["encoded"])))
    (pong,) = robot.sent()
    payload = bytes.fromhex(str(vector["payload"]))[:4]
    assert pong == Frame(messages.MessageType.PONG, int(str(vector["seq"])), payload + bytes(4))


@needs_compiler
@given(st.binary(max_size=200))
def test_c_and_python_write_the_same_bytes(data: bytes) -> None:
    """Of any payload: the robot's infrared fragments are frames that hold what it was given."""
    robot = HostRobot()
    robot.ask(messages.hello(7, 100, 1))
    command = messages.Command(7, 0, 0, 500, beacon=True)
    robot.ask([messages.ir_load(7, 3, len(data), 0, data, 2), command.frame(3)])
    robot.run(400)
    sent = robot.sent_ir()
    reader = FrameReader()
    frames = list(reader.feed(sent))
    assert reader.bad_frames == 0
    assert b"".join(map(encode_frame, frames)) == sent
    parts = {frame.payload[1]: frame.payload[3:] for frame in frames}
    assert b"".join(parts[k] for k in sorted(parts)) == data[: 48 * len(parts)]


@given(st.lists(FRAMES, max_size=5), st.integers(1, 7))
def test_a_stream_is_read_whatever_pieces_it_comes_in(frames: list[Frame], size: int) -> None:
    """Every frame once, in order."""
    stream = b"\0" + b"".join(map(encode_frame, frames))
    reader = FrameReader()
    pieces = [stream[k : k + size] for k in range(0, len(stream), size)]
    assert [frame for piece in pieces for frame in reader.feed(piece)] == frames
    assert reader.bad_frames == 0


@given(st.binary(max_size=2000), FRAMES)
def test_garbage_is_counted_and_the_next_frame_is_read(garbage: bytes, frame: Frame) -> None:
    """What is received before a delimiter cannot hide what follows it, nor take memory."""
    reader = FrameReader()
    read = list(reader.feed(garbage + b"\0" + encode_frame(frame)))
    assert read[-1] == frame
    assert len(read) - 1 + reader.bad_frames == sum(part != b"" for part in garbage.split(b"\0"))
    assert len(reader._rest) <= 260


@given(FRAMES, st.data())
def test_flipped_bits_of_what_a_frame_holds_are_found(frame: Frame, data: st.DataObject) -> None:
    """Up to three never pass; of flips in the stuffing, which move many bits, one in 65,536 may."""
    body = bytearray(cobs.decode(encode_frame(frame)[:-1]))
    bits = st.integers(0, 8 * len(body) - 1)
    for bit in data.draw(st.sets(bits, min_size=1, max_size=3)):
        body[bit // 8] ^= 1 << bit % 8
    with pytest.raises(FrameError):
        decode_frame(cobs.encode(bytes(body)))


def test_the_crc_is_ccitt_false() -> None:
    """Its published check value."""
    assert binascii.crc_hqx(b"123456789", 0xFFFF) == 0x29B1


def test_a_payload_that_is_too_long_is_refused() -> None:
    """It would not fit the firmware's buffer."""
    with pytest.raises(FrameError, match="at most 240"):
        encode_frame(Frame(1, 1, bytes(241)))
