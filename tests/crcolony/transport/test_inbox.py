"""The inbox of a process returns events of bodies first, is bounded, and wakes its loop for every event."""

import os
import sys
import threading
from collections.abc import Iterator
from functools import partial

import pytest

from crcolony.transport.inbox import Inbox
from crcolony.transport.interface import (
    ActionReceived,
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


# Files, on Linux only -------------------------------------------------------------------------------------------------

linux = pytest.mark.skipif(sys.platform != "linux", reason="no files can be waited for here")


@pytest.fixture
def bells() -> Iterator[list[int]]:
    """Three eventfds."""
    made = [os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC) for _ in range(3)]
    yield made
    for bell in made:
        os.close(bell)


def ring(bell: int) -> None:
    os.eventfd_write(bell, 1)


@linux
def test_a_file_is_handled_as_long_as_it_has_something_to_read() -> None:
    """And no more when it is forgotten; nobody else reads it."""
    inbox, handled = Inbox(), 0
    out, into = os.pipe()

    def handle() -> None:
        nonlocal handled
        handled += 1

    inbox.watch(out, handle)
    assert inbox.get(0.0) is None
    assert handled == 0
    os.write(into, b"ab")
    for expected in (1, 2):
        assert inbox.get(30.0) is None, "it returns for the file's sake"
        assert handled == expected
    inbox.forget(out)
    assert inbox.get(0.0) is None
    assert handled == 2
    for end in (out, into):
        os.close(end)


@linux
def test_a_bell_is_handled_once_whenever_it_is_rung(bells: list[int]) -> None:
    """Without being read."""
    inbox, handled = Inbox(), list[int]()
    for bell in bells:
        inbox.watch(bell, partial(handled.append, bell), is_bell=True)
    ring(bells[0])
    inbox.get(0.0)
    inbox.get(0.0)
    assert handled == [bells[0]]
    for bell in (*bells, bells[1]):
        ring(bell)
    inbox.get(0.0)
    inbox.get(0.0)
    assert sorted(handled[1:]) == sorted(bells)


@linux
def test_what_a_file_brings_precedes_what_the_network_has_brought(bells: list[int]) -> None:
    """Envelopes, and also observations and actions that somebody floods it with, wait for a robot on this machine."""
    inbox = Inbox()
    inbox.watch(bells[0], lambda: inbox.put_urgent(OBSERVATION), is_bell=True)
    flood = ActionReceived(ROBOT, b"action")
    for number in range(3):
        inbox.deliver(envelope(number))
        inbox.deliver(flood)
    ring(bells[0])
    assert all_in(inbox) == [OBSERVATION, flood, flood, flood, *map(envelope, range(3))]


@linux
def test_a_file_that_is_forgotten_in_the_same_round_is_not_handled(bells: list[int]) -> None:
    """Nor is another one that has its number now: it has nothing to read."""
    inbox, handled = Inbox(), list[str]()
    first, second = bells[:2]

    def replace(other: int) -> None:
        handled.append("one of them")
        inbox.forget(other)
        inbox.watch(other, lambda: handled.append("another file"), is_bell=False)
        os.eventfd_read(other)

    inbox.watch(first, lambda: replace(second))
    inbox.watch(second, lambda: replace(first))
    ring(first)
    ring(second)
    inbox.get(0.0)
    assert handled == ["one of them"]


@linux
def test_waiting_for_a_bell_ends_for_everything(bells: list[int]) -> None:
    """Only where nothing else has happened it says so, and handles nothing."""
    inbox, handled = Inbox(), list[int]()
    bell, other, _ = bells
    for each in (bell, other):
        inbox.watch(each, partial(handled.append, each), is_bell=True)
    assert not inbox.wait_for_bell(bell, 0.0)
    assert not inbox.wait_for_bell(bell, -1.0)
    assert not inbox.wait_for_bell(bell, 0.001)
    ring(bell)
    assert inbox.wait_for_bell(bell, 30.0)
    assert not handled
    ring(other)
    assert not inbox.wait_for_bell(bell, 30.0)
    assert handled == [other]
    ring(bell)
    inbox.deliver(ONLINE)
    assert not inbox.wait_for_bell(bell, 30.0)
    assert handled == [other, bell], "it is handled, if something else is there"
    assert all_in(inbox) == [ONLINE]
    inbox.wake()
    assert not inbox.wait_for_bell(bell, 30.0)


@linux
def test_no_ring_is_lost_between_threads(bells: list[int]) -> None:
    """A robot and an arena that ring each other 5,000 times never both wait; envelopes come in between."""
    here, there = Inbox(), Inbox()
    to_here, to_there, _ = bells
    here.watch(to_here, lambda: here.put_urgent(OBSERVATION), is_bell=True)
    there.watch(to_there, lambda: ring(to_here), is_bell=True)
    turns, stopped, envelopes = 0, threading.Event(), 0

    def answer() -> None:
        while not stopped.is_set():
            there.get(10.0)

    def disturb() -> None:
        for number in range(1000):
            here.deliver(envelope(number))

    threads = [threading.Thread(target=answer), threading.Thread(target=disturb)]
    for thread in threads:
        thread.start()
    try:
        ring(to_there)
        while turns < 5000:
            if here.is_empty and here.wait_for_bell(to_here, 10.0):
                got: InboundEvent | None = OBSERVATION
            else:
                got = here.get(10.0)
            if got == OBSERVATION:
                turns += 1
                ring(to_there)
            elif got is not None:
                envelopes += 1
        threads[1].join(10.0)
        assert envelopes + len([event for event in all_in(here) if event != OBSERVATION]) == 1000
    finally:
        stopped.set()
        there.wake()
    threads[0].join(10.0)
    assert not threads[0].is_alive()
