"""The inbox of a process returns events of bodies first, is bounded, and wakes its loop for every event."""

import threading

from crcolony.transport.inbox import Inbox
from crcolony.transport.interface import (
    EnvelopeReceived,
    InboundEvent,
    ObservationReceived,
    QueryReceived,
    RobotOffline,
    RobotOnline,
)

ROBOT = bytes(16)
ONLINE, OFFLINE = RobotOnline(ROBOT, 1, "s"), RobotOffline(ROBOT, 1, "s")
OBSERVATION = ObservationReceived(ROBOT, b"observation")


def envelope(number: int, size: int = 8) -> EnvelopeReceived:
    return EnvelopeReceived(ROBOT, number.to_bytes(size, "big"))


def all_in(inbox: Inbox) -> list[InboundEvent]:
    """Return all events that wait, in the order in which the loop gets them."""
    waiting = []
    while (event := inbox.get(0.0)) is not None:
        waiting.append(event)
    return waiting


def test_an_observation_precedes_envelopes_that_arrived_earlier() -> None:
    """So no flood of envelopes makes a control step late."""
    inbox = Inbox()
    for event in (envelope(1), envelope(2), OBSERVATION):
        inbox.deliver(event)
    assert all_in(inbox) == [OBSERVATION, envelope(1), envelope(2)]


def test_envelopes_and_presence_keep_their_order() -> None:
    """An envelope that a robot sent before it left is handled before its leaving."""
    inbox = Inbox()
    inbound: list[InboundEvent] = [ONLINE, envelope(1), OFFLINE, envelope(2)]
    for event in inbound:
        inbox.deliver(event)
    assert all_in(inbox) == inbound


def test_envelopes_beyond_the_limit_are_dropped_and_counted_but_presence_never() -> None:
    """A robot that goes offline is noticed in the middle of a flood."""
    inbox = Inbox()
    for number in range(3000):
        inbox.deliver(envelope(number))
    inbox.deliver(QueryReceived("history", ROBOT, b"?", lambda _: None))
    inbox.deliver(OFFLINE)
    waiting = all_in(inbox)
    assert waiting == [*map(envelope, range(2048)), OFFLINE]
    assert inbox.dropped == 3000 - 2048 + 1


def test_the_inbox_is_bounded_in_bytes() -> None:
    """Envelopes of the maximum length do not fill the memory, and room that becomes free is used again."""
    inbox = Inbox()
    for _ in range(2):
        for number in range(1000):
            inbox.deliver(envelope(number, size=65_536))
        assert len(all_in(inbox)) == 128
    assert inbox.dropped == 2 * (1000 - 128)


def test_observations_beyond_the_limit_are_dropped_and_counted() -> None:
    """Urgent events do not fill the memory either."""
    inbox = Inbox()
    for _ in range(3000):
        inbox.deliver(OBSERVATION)
    assert len(all_in(inbox)) == 2048
    assert inbox.dropped == 3000 - 2048


def test_every_kind_of_event_wakes_the_loop() -> None:
    """An observation, an envelope, a robot that comes online, and `wake`, which delivers nothing."""
    for delivered in (OBSERVATION, envelope(1), ONLINE, None):
        inbox = Inbox()
        got: list[InboundEvent | None] = []

        def wait(inbox: Inbox = inbox, got: list[InboundEvent | None] = got) -> None:
            got.append(inbox.get(30.0))

        waiting = threading.Thread(target=wait)
        waiting.start()
        if delivered is None:
            inbox.wake()
        else:
            inbox.deliver(delivered)
        waiting.join(10.0)
        assert got == [delivered]


def test_no_envelope_is_lost_between_threads() -> None:
    """Four threads deliver 2,000 envelopes each, in small parts, to a loop that never waits longer than it must."""
    inbox = Inbox()
    got: list[InboundEvent] = []
    taken = threading.Semaphore(0)

    def deliver() -> None:
        for number in range(2000):
            inbox.deliver(envelope(number))
            if number % 50 == 49:
                assert taken.acquire(timeout=10.0)

    threads = [threading.Thread(target=deliver) for _ in range(4)]
    for thread in threads:
        thread.start()
    while len(got) < 8000:
        event = inbox.get(10.0)
        if event is not None:
            got.append(event)
            if len(got) % 50 == 0:
                taken.release()
    for thread in threads:
        thread.join(10.0)
    assert inbox.dropped == 0
