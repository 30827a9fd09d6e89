"""Events are numbered, and observers that missed some can request all that are kept."""

from crcolony.nodes.event_buffer import EventBuffer
from crcolony.protocol.codec import encode
from crcolony.protocol.telemetry_messages import (
    MAX_HISTORY_EVENTS,
    EventMessage,
    Fault,
    HistoryRequest,
    decode_event,
    decode_history_reply,
)
from tests.support.lone_robot import ME


def test_events_are_numbered_without_gaps() -> None:
    """From 1 in every incarnation."""
    buffer = EventBuffer(ME.id, 5)
    messages = [decode_event(buffer.append(Fault(k, "x"), 7)) for k in range(3)]
    assert messages == [EventMessage(ME.id, 5, k + 1, 7, Fault(k, "x")) for k in range(3)]
    assert buffer.seq == 3


def test_repeated_requests_return_everything_that_is_kept() -> None:
    """In replies of limited size, each of which can be decoded; the oldest events are discarded."""
    buffer = EventBuffer(ME.id, 5)
    for k in range(11_000):
        buffer.append(Fault(k, "x" * 300), 7)
    received: list[int] = []
    first = 1
    while first <= buffer.seq:
        reply = decode_history_reply(encode(buffer.reply_to(HistoryRequest(5, first))))
        assert 0 < len(reply.events) <= MAX_HISTORY_EVENTS
        assert reply.oldest == 1_001
        received += [decode_event(data).seq for data in reply.events]
        first = received[-1] + 1
    assert received == list(range(1_001, 11_001))


def test_there_are_no_events_of_another_incarnation_or_of_the_future() -> None:
    """The reply names its incarnation."""
    buffer = EventBuffer(ME.id, 5)
    buffer.append(Fault(1, "x"), 7)
    assert buffer.reply_to(HistoryRequest(4, 1)).events == []
    assert buffer.reply_to(HistoryRequest(5, 2)).events == []
    assert buffer.reply_to(HistoryRequest(4, 1)).incarnation == 5
