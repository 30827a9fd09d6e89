"""The script for MicroPython, run by this Python in virtual time: it speaks as the reference firmware does."""

import json

import pytest
from crcolony_bridge.micropython import robot_script as script
from crcolony_bridge.reference_firmware import messages
from crcolony_bridge.reference_firmware.frames import (
    Frame,
    FrameError,
    FrameReader,
    decode_frame,
    encode_frame,
)
from crcolony_bridge.reference_firmware.messages import (
    Boot,
    Command,
    Info,
    MessageType,
    NakReason,
    Status,
)
from hypothesis import given
from hypothesis import strategies as st

from tests.robot_firmware_bridge.micropython.scripted_robot import FakeBoard, ScriptedRobot

SESSION = 0xC0FFEE
DRIVE = Command(SESSION, 200, -100, 250)


@pytest.fixture
def robot() -> ScriptedRobot:
    """A robot that has been greeted."""
    made = ScriptedRobot()
    made.ask(messages.hello(SESSION, 20, 1))
    return made


def refusals(frames: list[Frame]) -> list[NakReason]:
    return [NakReason(frame.payload[1]) for frame in frames if frame.type == MessageType.NAK]


@given(st.integers(0, 255), st.integers(0, 65535), st.binary(max_size=100))
def test_frames_are_those_of_the_reference_firmware(type_: int, seq: int, payload: bytes) -> None:
    """In both directions, byte for byte."""
    encoded = encode_frame(Frame(type_, seq, payload))
    assert script.encode(type_, seq, payload) == encoded
    assert script.decode(encoded[:-1])[4:] == payload


@given(st.binary(min_size=1, max_size=80))
def test_what_is_no_frame_is_refused(data: bytes) -> None:
    """By both decoders, or by neither."""
    encoded = data.replace(b"\0", b"\1")
    try:
        expected = decode_frame(encoded).payload
    except FrameError:
        assert script.decode(encoded) == b""
    else:
        assert script.decode(encoded)[4:] == expected


def test_a_robot_says_what_it_is_and_measures() -> None:
    """And no telemetry before it is asked."""
    robot = ScriptedRobot()
    robot.run(300)
    assert robot.sent() == []
    (reply,) = robot.ask(messages.hello(SESSION, 20, 9))
    info = Info.parse(reply)
    assert (reply.seq, info.session, info.uid, info.max_ttl_ms) == (
        9,
        SESSION,
        bytes(range(1, 9)),
        500,
    )
    (part,) = robot.ask(messages.describe(0, 10))
    assert json.loads(messages.parse_description(part)[2]) == {"model": "no hardware"}
    telemetry = robot.telemetry()
    assert (telemetry.battery_mv, telemetry.proximity_mm) == (8000, (50, 100))
    (pong,) = robot.ask(messages.ping(7, 11))
    assert pong.type == MessageType.PONG


@pytest.mark.parametrize("ttl_ms", [0, 1, 20, 250, 500, 501, 65_535])
def test_wheels_stop_when_the_time_to_live_is_over(robot: ScriptedRobot, ttl_ms: int) -> None:
    """And after half a second whatever a command says."""
    lives_ms = min(ttl_ms, 500)
    robot.ask(Command(SESSION, 200, -100, ttl_ms).frame(2))
    assert robot.board.wheels == ((200, -100) if ttl_ms else (0, 0))
    robot.run(max(lives_ms - 1, 0))
    assert robot.board.wheels == ((200, -100) if ttl_ms else (0, 0))
    robot.run(1)
    assert robot.board.wheels == (0, 0)
    assert (Status.EXPIRED in robot.telemetry().status) == (ttl_ms > 0)


def test_an_emergency_stop_is_latched(robot: ScriptedRobot) -> None:
    """Anyone may stop, only the controller may release it, and nothing moves by itself then."""
    robot.ask(DRIVE.frame(2))
    (ack,) = robot.ask(messages.stop(3))
    assert (ack.type, ack.payload) == (MessageType.ACK, bytes([MessageType.STOP]))
    assert robot.board.wheels == (0, 0)
    assert refusals(robot.ask(DRIVE.frame(4))) == [NakReason.STOPPED]
    assert refusals(robot.ask(messages.clear(SESSION + 1, 5))) == [NakReason.SESSION]
    assert Status.STOPPED in robot.telemetry().status
    (ack,) = robot.ask(messages.clear(SESSION, 6))
    assert ack.type == MessageType.ACK
    assert robot.board.wheels == (0, 0)
    robot.ask(DRIVE.frame(7))
    assert robot.board.wheels == (200, -100)


def test_one_controller_at_a_time(robot: ScriptedRobot) -> None:
    """A second one is refused while the first is there, and gets a robot that stands still after it is gone."""
    robot.ask(DRIVE.frame(2))
    other = messages.hello(SESSION + 1, 20, 1)
    assert refusals(robot.ask(other)) == [NakReason.SESSION]
    assert refusals(robot.ask(Command(SESSION + 1, 9, 9, 250).frame(2))) == [NakReason.SESSION]
    robot.run(999)
    assert refusals(robot.ask(other)) == [NakReason.SESSION]
    robot.run(1)
    assert Info.parse(robot.ask(other)[0]).session == SESSION + 1
    assert refusals(robot.ask(DRIVE.frame(4))) == [NakReason.SESSION]


def test_a_battery_that_is_critical_stops_the_wheels(robot: ScriptedRobot) -> None:
    """With hysteresis, so that a robot does not twitch at the threshold."""
    robot.ask(DRIVE.frame(2))
    robot.board.mv = 6100
    robot.run(1)
    assert robot.board.wheels == (0, 0)
    assert refusals(robot.ask(DRIVE.frame(3))) == [NakReason.BATTERY]
    for mv, expected in ((6300, [NakReason.BATTERY]), (6400, [])):
        robot.board.mv = mv
        robot.run(1)
        assert refusals(robot.ask(DRIVE.frame(4))) == expected
    assert Status.BATTERY_LOW in robot.telemetry().status


@pytest.mark.parametrize(
    ("frame", "reason"),
    [
        (Frame(MessageType.HELLO, 5, b"\0" * 5), NakReason.LENGTH),
        (Frame(MessageType.COMMAND, 5, b"\0" * 14), NakReason.LENGTH),
        (Frame(MessageType.IR_LOAD, 5, b"\0" * 20), NakReason.UNKNOWN),
        (Frame(MessageType.PING, 5, b"\0" * 4, version=2), NakReason.VERSION),
    ],
)
def test_what_is_no_request_is_refused(
    robot: ScriptedRobot, frame: Frame, reason: NakReason
) -> None:
    """With its sequence number and the reason."""
    (nak,) = robot.ask(frame)
    assert (nak.seq, nak.payload) == (5, bytes([frame.type, reason]))


@given(st.lists(st.binary(max_size=60) | st.integers(0, 300), max_size=20))
def test_wheels_never_turn_without_a_living_command(inputs: list[bytes | int]) -> None:
    """Whatever bytes arrive, and whenever; and they take no more memory than the longest request."""
    robot = ScriptedRobot()
    robot.ask(messages.hello(SESSION, 20, 1))
    for piece in inputs:
        if isinstance(piece, int):
            robot.run(piece)
        else:
            robot.receive(piece)
        assert robot.board.wheels == (0, 0)
        assert len(robot.robot.rest) <= 65


def test_a_request_that_is_too_long_is_counted_and_the_next_one_is_read(
    robot: ScriptedRobot,
) -> None:
    """Whatever it would have been."""
    long_request = Frame(MessageType.STOP, 2, bytes(100))
    for byte in encode_frame(long_request):
        robot.receive(bytes([byte]))
    assert robot.ask(messages.ping(1, 3))[0].type == MessageType.PONG
    telemetry = robot.telemetry()
    assert telemetry.bad_frames == 1
    assert Status.STOPPED not in telemetry.status


def test_what_ends_the_script_stops_the_wheels() -> None:
    """And a request that memory does not suffice for ends nothing."""
    board = FakeBoard()
    hello, drive = messages.hello(SESSION, 20, 1), DRIVE.frame(2)
    board.inputs = [encode_frame(hello), encode_frame(drive)]
    with pytest.raises(EOFError):
        script.run(board)
    assert (board.wheels, board.is_released) == ((0, 0), True)
    frames = list(FrameReader().feed(board.sent))
    assert Boot.parse(frames[0]).uid == board.uid


def test_without_memory_a_robot_stands_still_and_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its latch is kept."""
    board = FakeBoard()
    battery_mv = board.battery_mv

    def fail_once() -> int:
        monkeypatch.setattr(board, "battery_mv", battery_mv)
        raise MemoryError

    monkeypatch.setattr(board, "battery_mv", fail_once)
    requests = [messages.hello(SESSION, 20, 1), messages.stop(3)]
    board.inputs = [b"".join(map(encode_frame, requests)), b"", encode_frame(DRIVE.frame(2))]
    with pytest.raises(EOFError):
        script.run(board)
    assert board.wheels == (0, 0)
    assert refusals(list(FrameReader().feed(board.sent))) == [NakReason.STOPPED]
