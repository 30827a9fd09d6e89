"""The firmware's core, as it is in C: wheels turn only while a command of the present session is alive."""

import pytest
from crcolony_bridge.infrared.ir_messages import Fragment, IrReceiver, seal, tag_of
from crcolony_bridge.reference_firmware import messages
from crcolony_bridge.reference_firmware.frames import Frame, FrameReader, encode_frame
from crcolony_bridge.reference_firmware.messages import (
    Boot,
    Command,
    Info,
    MessageType,
    NakReason,
    Status,
)
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.robot_firmware_bridge.firmware import HostRobot, needs_compiler

pytestmark = needs_compiler

SESSION = 0xC0FFEE
DRIVE = Command(SESSION, 200, -100, 250)
MAX_TTL_MS = 500


@pytest.fixture
def robot() -> HostRobot:
    """A robot that has been greeted."""
    made = HostRobot()
    made.ask(messages.hello(SESSION, 20, 1))
    return made


def refusals(frames: list[Frame]) -> list[NakReason]:
    return [NakReason(frame.payload[1]) for frame in frames if frame.type == MessageType.NAK]


def test_a_robot_says_why_it_was_reset_and_what_it_is() -> None:
    """Without being asked the one, on HELLO the other."""
    robot = HostRobot()
    (boot,) = robot.sent()
    assert Boot.parse(boot) == Boot(1, bytes(range(1, 9)))
    (info,) = robot.ask(messages.hello(SESSION, 20, 9))
    assert info.seq == 9
    assert Info.parse(info).session == SESSION
    assert Info.parse(info).max_ttl_ms == MAX_TTL_MS
    (part,) = robot.ask(messages.describe(0, 10))
    assert messages.parse_description(part)[2] == b'{"model":"no hardware"}'
    assert messages.parse_description(robot.ask(messages.describe(9999, 11))[0])[2] == b""


@pytest.mark.parametrize("ttl_ms", [0, 1, 20, 250, 500, 501, 65_535])
def test_wheels_stop_when_the_time_to_live_is_over(robot: HostRobot, ttl_ms: int) -> None:
    """In that very millisecond, and after half a second whatever a command says."""
    lives_ms = min(ttl_ms, MAX_TTL_MS)
    robot.ask(Command(SESSION, 200, -100, ttl_ms).frame(2))
    assert robot.wheels == ((200, -100) if ttl_ms else (0, 0))
    robot.run(max(lives_ms - 1, 0))
    assert robot.wheels == ((200, -100) if ttl_ms else (0, 0))
    robot.run(1)
    assert robot.wheels == (0, 0)
    assert (Status.EXPIRED in robot.telemetry().status) == (ttl_ms > 0)


@pytest.mark.parametrize("start_ms", [0, 2**32 - 100])
def test_the_clock_may_wrap(start_ms: int) -> None:
    """After 49 days a command lives as long as before."""
    robot = HostRobot()
    robot.start(start_ms)
    robot.ask([messages.hello(SESSION, 20, 1), DRIVE.frame(2)])
    robot.run(249)
    assert robot.wheels == (200, -100)
    robot.run(1)
    assert robot.wheels == (0, 0)
    assert len([frame for frame in robot.sent() if frame.type == MessageType.TELEMETRY]) >= 12


def test_an_emergency_stop_is_latched(robot: HostRobot) -> None:
    """Anyone may stop, only the controller may release it, and nothing moves by itself then."""
    robot.ask(DRIVE.frame(2))
    (ack,) = robot.ask(messages.stop(3))
    assert (ack.type, ack.payload) == (MessageType.ACK, bytes([MessageType.STOP]))
    assert robot.wheels == (0, 0)
    assert refusals(robot.ask(DRIVE.frame(4))) == [NakReason.STOPPED]
    assert refusals(robot.ask(messages.clear(SESSION + 1, 5))) == [NakReason.SESSION]
    assert Status.STOPPED in robot.telemetry().status
    (ack,) = robot.ask(messages.clear(SESSION, 6))
    assert ack.type == MessageType.ACK
    assert robot.wheels == (0, 0)
    robot.ask(DRIVE.frame(7))
    assert robot.wheels == (200, -100)


def test_a_second_stop_counts(robot: HostRobot) -> None:
    """It is confirmed like the first."""
    for seq in (2, 3):
        assert [frame.type for frame in robot.ask(messages.stop(seq))] == [MessageType.ACK]


def test_a_watchdog_releases_no_stop(robot: HostRobot) -> None:
    """After a reset by the watchdog the latch is as it was."""
    robot.ask(messages.stop(2))
    robot.start(cause=3, keeps_latch=True)
    robot.ask(messages.hello(SESSION, 20, 1))
    assert refusals(robot.ask(DRIVE.frame(2))) == [NakReason.STOPPED]


def test_one_controller_at_a_time(robot: HostRobot) -> None:
    """A second one is refused while the first is there, and gets a robot that stands still after it is gone."""
    robot.ask(DRIVE.frame(2))
    other = messages.hello(SESSION + 1, 20, 1)
    assert refusals(robot.ask(other)) == [NakReason.SESSION]
    assert refusals(robot.ask(Command(SESSION + 1, 9, 9, 250).frame(2))) == [NakReason.SESSION]
    assert robot.wheels == (200, -100)
    robot.run(1000)
    robot.ask(DRIVE.frame(3))
    assert refusals(robot.ask(other)) == [NakReason.SESSION], "the first one was heard again"
    robot.run(1000)
    assert Info.parse(robot.ask(other)[0]).session == SESSION + 1
    assert refusals(robot.ask(DRIVE.frame(4))) == [NakReason.SESSION]


def test_a_battery_that_is_critical_stops_the_wheels(robot: HostRobot) -> None:
    """With hysteresis, so that a robot does not twitch at the threshold."""
    robot.ask(DRIVE.frame(2))
    robot.set_battery(6100)
    robot.run(1)
    assert robot.wheels == (0, 0)
    assert refusals(robot.ask(DRIVE.frame(3))) == [NakReason.BATTERY]
    for mv, expected in ((6300, [NakReason.BATTERY]), (6400, [])):
        robot.set_battery(mv)
        robot.run(1)
        assert refusals(robot.ask(DRIVE.frame(4))) == expected
    assert robot.telemetry().status & Status.BATTERY_LOW
    robot.set_battery(7000)
    assert not robot.telemetry().status & Status.BATTERY_LOW


@pytest.mark.parametrize(
    ("frame", "reason"),
    [
        (Frame(MessageType.HELLO, 5, b"\0" * 5), NakReason.LENGTH),
        (Frame(MessageType.COMMAND, 5, b"\0" * 14), NakReason.LENGTH),
        (Frame(0x77, 5, b""), NakReason.UNKNOWN),
        (Frame(MessageType.PING, 5, b"\0" * 4, version=2), NakReason.VERSION),
    ],
)
def test_what_is_no_request_is_refused(robot: HostRobot, frame: Frame, reason: NakReason) -> None:
    """With its sequence number and the reason."""
    (nak,) = robot.ask(frame)
    assert (nak.seq, nak.payload) == (5, bytes([frame.type, reason]))


def test_a_payload_may_grow(robot: HostRobot) -> None:
    """What a later version adds at its end is ignored."""
    command = DRIVE.frame(2)
    robot.ask(Frame(command.type, command.seq, command.payload + b"more"))
    assert robot.wheels == (200, -100)


def test_the_watchdog_is_fed_by_the_control_path_alone(robot: HostRobot) -> None:
    """By no byte that arrives."""
    robot.is_fed()
    robot.ask([messages.ping(1, 2), DRIVE.frame(3), messages.stop(4)])
    assert not robot.is_fed()
    robot.run(1)
    assert robot.is_fed()


def test_telemetry_is_not_made_up_for(robot: HostRobot) -> None:
    """A transmit queue that was full loses it; afterwards it comes at its period."""
    robot.set_room(0, 0)
    robot.run(1000)
    robot.set_room(0, 4096)
    robot.sent()
    robot.run(100)
    assert len(robot.sent()) == 5


@settings(max_examples=200)
@given(st.lists(st.binary(max_size=60) | st.integers(0, 300), max_size=20), st.randoms())
def test_wheels_never_turn_without_a_living_command(
    inputs: list[bytes | int], random: object
) -> None:
    """Whatever bytes arrive, and whenever: without a valid command there is no motion."""
    robot = HostRobot()
    robot.ask(messages.hello(SESSION, 20, 1))
    for piece in inputs:
        if isinstance(piece, int):
            robot.run(piece)
        else:
            robot.receive(piece)
            robot.receive_ir(piece)
        assert robot.wheels == (0, 0)


@given(st.binary(min_size=1, max_size=700), st.floats(0.0, 0.3), st.randoms(use_true_random=False))
def test_a_message_passes_infrared_with_losses(message: bytes, loss: float, random: object) -> None:
    """Two robots: the sender's beacon repeats it until the receiver's host has it, whole and once."""
    sender, receiver = HostRobot(), IrReceiver()
    sealed = seal(message)
    sender.ask(messages.hello(SESSION, 100, 1))
    for offset in range(0, len(sealed), 200):
        part = sealed[offset : offset + 200]
        load = messages.ir_load(SESSION, tag_of(sealed), len(sealed), offset, part, 2)
        assert [frame.type for frame in sender.ask(load)] == [MessageType.ACK]
    complete: list[bytes] = []
    for round_ in range(400):
        sender.ask(Command(SESSION, 0, 0, 500, beacon=True).frame(round_))
        sender.run(100)
        on_air = sender.sent_ir()
        fragments = [part + b"\0" for part in on_air.split(b"\0") if part]
        kept = [f for f in fragments if random.random() >= loss]  # type: ignore[attr-defined]
        complete += complete_in(receiver, b"".join(kept))
        if complete:
            break
    assert complete == [message]


def complete_in(receiver: IrReceiver, on_air: bytes) -> list[bytes]:
    """Return the messages that are complete after a receiver has heard these bytes."""
    found = []
    for frame in FrameReader().feed(on_air):
        tag, index, count = frame.payload[:3]
        message = receiver.add(Fragment(tag, index, count, frame.payload[3:]))
        found += [message] if message is not None else []
    return found


def test_what_arrives_by_infrared_is_passed_on(robot: HostRobot) -> None:
    """Whole fragments alone, and none before there is a controller."""
    fragment = Frame(MessageType.IR_FRAGMENT, 1, bytes([9, 1, 2]) + b"part")
    robot.sent()
    robot.receive_ir(b"garbage\0" + encode_frame(fragment) + encode_frame(Frame(0x20, 1, b"")))
    (received,) = robot.sent()
    assert received.type == MessageType.IR_RECEIVED
    assert messages.parse_fragment(received) == Fragment(9, 1, 2, b"part")
    robot.start()
    robot.sent()
    robot.receive_ir(encode_frame(fragment))
    assert robot.sent() == []


def test_without_a_beacon_nothing_is_sent(robot: HostRobot) -> None:
    """And a message that is loaded in part is not."""
    load = messages.ir_load(SESSION, 1, 10, 0, b"12345", 2)
    robot.ask([load, Command(SESSION, 0, 0, 500, beacon=True).frame(3)])
    robot.run(100)
    assert robot.sent_ir() == b""
    robot.ask(messages.ir_load(SESSION, 1, 10, 5, b"67890", 4))
    robot.run(100)
    assert robot.sent_ir() != b""
    robot.run(500)
    robot.sent_ir()
    robot.run(200)
    assert robot.sent_ir() == b"", "the command that had switched the beacon on is over"
    assert encode_frame(load)
