"""In whatever order events arrive, lost or repeated, each is accepted once, and in the end none is missing."""

from collections import deque

from hypothesis import given
from hypothesis import strategies as st

from crcolony.telemetry.sequence_gaps import MAX_GAPS, MAX_TRIES, REQUEST_DELAY_S, SequenceTracker

EVENTS = 40
REPLY_EVENTS = 5
"""Events in a reply of the robot below."""


class Robot:
    """A robot that has published `published` events and keeps the last `kept` of them."""

    def __init__(self, published: int, kept: int) -> None:
        self.published, self.oldest = published, max(1, published - kept + 1)

    def reply(self, sequence: SequenceTracker, first: int) -> list[int]:
        """Reply to a request; return the events that were new."""
        start = max(first, self.oldest)
        events = range(start, min(start + REPLY_EVENTS, self.published + 1))
        new = [seq for seq in events if sequence.record(seq, 0.0)]
        sequence.drop_before(self.oldest)
        sequence.handle_reply(first, is_empty=not events)
        return new


def request_all(
    sequence: SequenceTracker, robot: Robot, unix_s: float = REQUEST_DELAY_S
) -> list[int]:
    """Send requests until none is due; return the events that were new."""
    new: list[int] = []
    while (first := sequence.first_due(unix_s)) is not None:
        new += robot.reply(sequence, first)
    return new


arrivals = st.lists(st.integers(1, EVENTS), min_size=1, max_size=3 * EVENTS)
"""Some of the events, some of them repeatedly, in any order."""


@given(arrivals, st.integers(0, EVENTS))
def test_every_event_is_accepted_once_whatever_arrives(order: list[int], announced: int) -> None:
    """From the first on, and with a state somewhere in between."""
    sequence = SequenceTracker(order[0] - 1, history=EVENTS)
    accepted = [seq for seq in order[: len(order) // 2] if sequence.record(seq, 0.0)]
    sequence.announce_up_to(announced, 0.0)
    accepted += [seq for seq in order[len(order) // 2 :] if sequence.record(seq, 0.0)]
    assert sorted(accepted) == sorted(set(order))
    last = max(*order, announced)
    assert sequence.missing == last - len(accepted)
    accepted += request_all(sequence, Robot(EVENTS, EVENTS))
    assert sequence.missing == sequence.missed == 0
    assert sorted(accepted) == list(range(1, len(accepted) + 1))
    assert len(accepted) >= last


@given(arrivals, st.integers(1, EVENTS), st.integers(0, EVENTS))
def test_an_event_that_is_kept_no_longer_is_missed_if_it_was_published_since(
    order: list[int], kept: int, history: int
) -> None:
    """Earlier events are not missed, and an event that arrives late is missed no longer."""
    sequence = SequenceTracker(order[0] - 1, history)
    accepted = {seq for seq in order if sequence.record(seq, 0.0)}
    robot = Robot(EVENTS, kept)
    accepted |= set(request_all(sequence, robot))
    assert sequence.missing == 0
    lost = set(range(order[0], max(accepted))) - accepted
    assert sequence.missed == len(lost)
    assert all(seq < robot.oldest for seq in lost)
    late = set(range(1, EVENTS + 1)) - accepted
    assert {seq for seq in late if sequence.record(seq, 0.0)} == late
    assert sequence.missed == 0


@given(st.lists(st.integers(0, EVENTS), max_size=10), st.integers(0, EVENTS))
def test_a_number_that_never_existed_does_no_harm(forged: list[int], published: int) -> None:
    """The robot's reply is empty, and later events are accepted as they arrive."""
    sequence = SequenceTracker(0)
    accepted: deque[int] = deque()
    for seq in range(1, published + 1):
        assert sequence.record(seq, 0.0)
        accepted.append(seq)
        for number in forged:
            sequence.announce_up_to(number, 0.0)
        accepted += request_all(sequence, Robot(seq, EVENTS))
        assert sequence.missing == sequence.missed == 0
    assert list(accepted) == list(range(1, published + 1))


def test_earlier_events_are_wanted_as_far_back_as_asked() -> None:
    """And no further, though still earlier ones are accepted, too."""
    sequence = SequenceTracker(100, history=30)
    assert sequence.missing == 30
    assert sequence.first_due(0.0) == 71
    assert sequence.missed == 0
    assert sequence.record(50, 0.0)
    assert not sequence.record(50, 0.0)
    assert SequenceTracker(100).first_due(0.0) is None


def test_an_event_that_a_state_announces_may_be_on_its_way() -> None:
    """It is due after a second; one that a later event has skipped is due at once."""
    sequence = SequenceTracker(10)
    sequence.announce_up_to(12, 100.0)
    assert sequence.first_due(100.9) is None
    assert sequence.first_due(101.0) == 11
    sequence.record(11, 100.5)
    sequence.record(12, 100.5)
    assert sequence.first_due(200.0) is None
    sequence.record(15, 100.5)
    assert sequence.first_due(100.5) == 13


def test_a_gap_is_given_up_after_some_tries() -> None:
    """Its events are missed then, until they arrive after all."""
    sequence = SequenceTracker(10)
    sequence.record(15, 0.0)
    for _ in range(MAX_TRIES):
        assert sequence.first_due(0.0) == 11
        sequence.handle_no_reply(11)
    assert sequence.first_due(0.0) is None
    assert (sequence.missing, sequence.missed) == (0, 4)
    assert sequence.record(12, 0.0)
    assert sequence.missed == 3


def test_a_useful_reply_gives_the_rest_new_tries() -> None:
    """As long as there is progress the requests continue."""
    sequence = SequenceTracker(0)
    sequence.record(100, 0.0)
    for seq in range(1, 100):
        for _ in range(MAX_TRIES - 1):
            sequence.handle_no_reply(seq)
        assert sequence.first_due(0.0) == seq
        sequence.record(seq, 0.0)
    assert sequence.missed == 0


def test_of_an_incarnation_that_is_over_nothing_is_requested() -> None:
    """Its missing events are missed, unless they are older than the tracker."""
    sequence = SequenceTracker(10, history=5)
    sequence.record(14, 0.0)
    sequence.close()
    assert sequence.first_due(1e9) is None
    assert sequence.missed == 3
    assert sequence.fill_gap(12)
    assert not sequence.fill_gap(15)


def test_gaps_take_little_memory_however_many_there_are() -> None:
    """The oldest are closed: their events are missed for good."""
    sequence = SequenceTracker(0)
    for seq in range(1, 20_001, 2):
        assert sequence.record(seq, 0.0)
    assert sequence.missed == 9_999
    assert sequence.missing == MAX_GAPS
    assert not sequence.record(2, 0.0)
    assert sequence.record(19_998, 0.0)
    assert not sequence.record(19_998, 0.0)
