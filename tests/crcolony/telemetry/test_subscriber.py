"""A subscriber receives the telemetry of its colony over Zenoh, within limits, and handles it when it is polled."""

import contextlib
import threading
from collections.abc import Callable, Iterator

import pytest
import zenoh

from crcolony.protocol.codec import MAX_BODY_MESSAGE_BYTES, encode
from crcolony.protocol.key_expressions import ColonyKeys
from crcolony.protocol.signed_telemetry import TRAILER_BYTES, purpose_of_robot, sign_telemetry
from crcolony.protocol.telemetry_messages import (
    HistoryReply,
    HistoryRequest,
    RobotMetadata,
    decode_history_request,
)
from crcolony.telemetry import subscriber
from crcolony.telemetry.samples import RawSample
from crcolony.telemetry.status_changes import RobotJoined, RobotLeft, StatusChange
from crcolony.telemetry.subscriber import TelemetrySubscriber
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_session import free_port, open_session
from tests.support.fed_monitor import KEYS as MY_KEYS
from tests.support.fed_monitor import ME, message, numbers, state

KEYS = ColonyKeys("blue")


def signed(message: bytes, count: int = 0) -> bytes:
    """Return what the robot says, as it is published."""
    return sign_telemetry(message, purpose_of_robot("blue"), MY_KEYS[0], count)


@pytest.fixture
def session() -> Iterator[zenoh.Session]:
    with open_session(NetworkSettings(listen=(f"tcp/127.0.0.1:{free_port()}",))) as opened:
        yield opened


def poll_until(receiver: TelemetrySubscriber, condition: Callable[[], bool]) -> list[StatusChange]:
    """Poll until a condition holds, at most 20 s; return the changes."""
    changes, pause = list[StatusChange](), threading.Event()
    for _ in range(2_000):
        changes += receiver.poll()
        if condition():
            return changes
        pause.wait(0.01)
    raise AssertionError("the condition does not hold after 20 s")


def test_too_much_at_once_is_dropped_and_counted(
    session: zenoh.Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Tokens have twice the room, since they are not repeated; a payload that is too long is not kept."""
    monkeypatch.setattr(subscriber, "_MAX_SAMPLES", 10)
    samples: list[RawSample] = []
    receiver = TelemetrySubscriber(session, "blue", on_raw_sample=samples.append)
    session.put(KEYS.state(ME), bytes(MAX_BODY_MESSAGE_BYTES + TRAILER_BYTES + 1))
    for _ in range(14):
        session.put(KEYS.event(ME), signed(b"noise"))
    tokens = [
        session.liveliness().declare_token(KEYS.alive(ME, incarnation, "a"))
        for incarnation in range(15)
    ]
    assert receiver.poll() == [RobotJoined(ME)]
    assert receiver.dropped == 5 + 5
    assert receiver.poll() == []
    assert len(tokens) == 15
    assert [sample.kind for sample in samples] == [*["event"] * 9, *["online"] * 10]
    assert receiver.refused == 1, "what is too long"
    assert receiver.monitor.malformed == 9


def test_a_robot_comes_online_and_goes_offline(session: zenoh.Session) -> None:
    """By its token; a robot of another colony is not seen."""
    receiver = TelemetrySubscriber(session, "blue")
    others = session.liveliness().declare_token(ColonyKeys("red").alive(bytes(16), 1, "a"))
    token = session.liveliness().declare_token(KEYS.alive(ME, 3, "a"))
    assert poll_until(receiver, lambda: bool(receiver.monitor.alive)) == [RobotJoined(ME)]
    token.undeclare()  # type: ignore[no-untyped-call]
    assert poll_until(receiver, lambda: not receiver.monitor.alive) == [RobotLeft(ME)]
    others.undeclare()  # type: ignore[no-untyped-call]
    assert list(receiver.monitor.robots) == [ME]


@contextlib.contextmanager
def replying_robot(session: zenoh.Session) -> Iterator[list[HistoryRequest]]:
    """A robot that replies to requests; yields the requests for history that it has received."""
    requests: list[HistoryRequest] = []

    def on_history(query: zenoh.Query) -> None:
        assert query.payload is not None
        requests.append(decode_history_request(query.payload.to_bytes()))
        events = [encode(message(seq)) for seq in range(requests[-1].first, 6)]
        query.reply(query.key_expr, signed(encode(HistoryReply(3, 1, events))))

    def on_metadata(query: zenoh.Query) -> None:
        query.reply(query.key_expr, signed(encode(RobotMetadata(ME, 3, "{}", [], ""))))

    entities = [
        session.declare_queryable(KEYS.history(ME), on_history),
        session.declare_queryable(KEYS.metadata(ME), on_metadata),
        session.liveliness().declare_token(KEYS.alive(ME, 3, "a")),
    ]
    yield requests
    for entity in entities:
        entity.undeclare()  # type: ignore[attr-defined]


def test_missed_events_and_metadata_are_requested(session: zenoh.Session) -> None:
    """Every event is reported once, earlier ones too, if the subscriber may send requests."""
    with replying_robot(session) as requests:
        receiver = TelemetrySubscriber(session, "blue", sends_requests=True, history=10)
        session.put(KEYS.state(ME), signed(encode(state(seq=5)), count=1))

        def is_complete() -> bool:
            robot = receiver.monitor.robots.get(ME)
            is_known = robot is not None and robot.metadata is not None
            return is_known and bool(requests) and receiver.monitor.samples["history"] > 0

        assert numbers(poll_until(receiver, is_complete)) == [1, 2, 3, 4, 5]
        assert requests == [HistoryRequest(3, 1)]


def test_without_leave_to_send_requests_none_is_sent(session: zenoh.Session) -> None:
    """`crcolony top` costs robots nothing."""
    with replying_robot(session) as requests:
        receiver = TelemetrySubscriber(session, "blue", history=10)
        session.put(KEYS.state(ME), signed(encode(state(seq=5))))
        poll_until(receiver, lambda: receiver.monitor.samples["state"] > 0)
        receiver.poll()
        assert requests == []
        assert receiver.monitor.robots[ME].metadata is None
