"""The inbox of a process: what bodies say comes first, what strangers say is bounded, and nobody waits in vain."""

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
SEEN, GONE = RobotOnline(ROBOT, 1, "s"), RobotOffline(ROBOT, 1, "s")
OBSERVED = ObservationReceived(ROBOT, b"observation")


def mail(number: int, size: int = 8) -> EnvelopeReceived:
    return EnvelopeReceived(ROBOT, number.to_bytes(size, "big"))


def all_in(inbox: Inbox) -> list[InboundEvent]:
    """Return all that waits, in the order in which it is looked at."""
    waiting = []
    while (event := inbox.get(0.0)) is not None:
        waiting.append(event)
    return waiting


def test_an_observation_is_looked_at_before_letters_that_came_earlier() -> None:
    """So that no flood of letters makes a control step late."""
    inbox = Inbox()
    for event in (mail(1), mail(2), OBSERVED):
        inbox.deliver(event)
    assert all_in(inbox) == [OBSERVED, mail(1), mail(2)]


def test_letters_and_presence_keep_their_order() -> None:
    """What a robot said before it left is looked at before its leaving."""
    inbox = Inbox()
    inbound: list[InboundEvent] = [SEEN, mail(1), GONE, mail(2)]
    for event in inbound:
        inbox.deliver(event)
    assert all_in(inbox) == inbound


def test_letters_beyond_the_limit_are_dropped_and_counted_but_presence_never() -> None:
    """A robot that comes or goes is noticed in the midst of a flood."""
    inbox = Inbox()
    for number in range(3000):
        inbox.deliver(mail(number))
    inbox.deliver(QueryReceived("history", ROBOT, b"?", lambda _: None))
    inbox.deliver(GONE)
    waiting = all_in(inbox)
    assert waiting == [*map(mail, range(2048)), GONE]
    assert inbox.dropped == 3000 - 2048 + 1


def test_what_waits_is_bounded_in_bytes() -> None:
    """Letters as long as they may be do not fill the memory; room that was made is used again."""
    inbox = Inbox()
    for _ in range(2):
        for number in range(1000):
            inbox.deliver(mail(number, size=65_536))
        assert len(all_in(inbox)) == 128
    assert inbox.dropped == 2 * (1000 - 128)


def test_observations_beyond_the_limit_are_dropped_and_counted() -> None:
    """Even what comes first does not fill the memory."""
    inbox = Inbox()
    for _ in range(3000):
        inbox.deliver(OBSERVED)
    assert len(all_in(inbox)) == 2048
    assert inbox.dropped == 3000 - 2048


def test_whoever_waits_is_woken_by_every_kind_of_arrival() -> None:
    """By an observation, a letter, a robot that comes, and by `wake`, which brings nothing."""
    for delivered in (OBSERVED, mail(1), SEEN, None):
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


def test_no_letter_is_missed_whatever_the_order_of_threads() -> None:
    """Four threads deliver 2,000 letters each, in small parts, to one that never waits longer than it must."""
    inbox = Inbox()
    got: list[InboundEvent] = []
    taken = threading.Semaphore(0)

    def deliver() -> None:
        for number in range(2000):
            inbox.deliver(mail(number))
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
