"""A robot keeps its recent events, and an observer can request those that it missed."""

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
from tests.vectors.make import INITIATOR


def test_events_are_numbered_without_gaps() -> None:
    """Numbers start at 1 in every incarnation."""
    buffer = EventBuffer(INITIATOR.id, 5)
    messages = [decode_event(buffer.append(Fault(k, "x"), 7)) for k in range(3)]
    assert messages == [EventMessage(INITIATOR.id, 5, k + 1, 7, Fault(k, "x")) for k in range(3)]
    assert buffer.seq == 3


def test_repeated_requests_return_every_event_that_is_kept() -> None:
    """Each reply has a limited size and can be decoded."""
    buffer = EventBuffer(INITIATOR.id, 5)
    for k in range(11_000):
        buffer.append(Fault(k, "x" * 300), 7)
    numbers: list[int] = []
    first = 1
    while first <= buffer.seq:
        reply = decode_history_reply(encode(buffer.reply_to(HistoryRequest(5, first))))
        assert 0 < len(reply.events) <= MAX_HISTORY_EVENTS
        assert reply.oldest == 1_001
        numbers += [decode_event(data).seq for data in reply.events]
        first = numbers[-1] + 1
    assert numbers == list(range(1_001, 11_001))


def test_the_oldest_events_go_when_all_are_too_large() -> None:
    """So a process of many robots has a limit for what all of them keep."""
    buffer = EventBuffer(INITIATOR.id, 5, max_bytes=10_000)
    sizes = [len(buffer.append(Fault(k, "x" * k), 7)) for k in range(200)]
    reply = buffer.reply_to(HistoryRequest(5, 1))
    kept = 200 - (reply.oldest - 1)
    assert sum(sizes[-kept:]) <= 10_000 < sum(sizes[-kept - 1 :])
    assert decode_event(reply.events[0]).seq == reply.oldest


def test_another_incarnation_and_the_future_have_no_events() -> None:
    """The reply contains the incarnation of the buffer."""
    buffer = EventBuffer(INITIATOR.id, 5)
    buffer.append(Fault(1, "x"), 7)
    assert buffer.reply_to(HistoryRequest(4, 1)).events == []
    assert buffer.reply_to(HistoryRequest(5, 2)).events == []
    assert buffer.reply_to(HistoryRequest(4, 1)).incarnation == 5
