"""Whatever order, loss and repetition events come in, each is taken once, and in the end none is missing."""

from collections import deque

from hypothesis import given
from hypothesis import strategies as st

from crcolony.telemetry.sequence_gaps import MAX_GAPS, PATIENCE_S, TRIES, SequenceTracker

EVENTS = 40
ANSWER = 5
"""Events in an answer of the robot below"""


class Robot:
    """What a robot has told so far, and keeps of it."""

    def __init__(self, message: int, kept: int) -> None:
        self.message, self.oldest = message, max(1, message - kept + 1)

    def answer(self, sequence: SequenceTracker, first: int) -> list[int]:
        """Let a question be answered; return what was new."""
        start = max(first, self.oldest)
        events = range(start, min(start + ANSWER, self.message + 1))
        new = [seq for seq in events if sequence.record(seq, 0.0)]
        sequence.drop_before(self.oldest)
        sequence.handle_reply(first, is_empty=not events)
        return new


def ask_all(sequence: SequenceTracker, robot: Robot, unix_s: float = PATIENCE_S) -> list[int]:
    """Ask until there is nothing to ask for; return what was new."""
    new: list[int] = []
    while (first := sequence.due(unix_s)) is not None:
        new += robot.answer(sequence, first)
    return new


numbers = st.lists(st.integers(1, EVENTS), min_size=1, max_size=3 * EVENTS)
"""What comes: some of the events, some of them again and again, in any order"""


@given(numbers, st.integers(0, EVENTS))
def test_every_event_is_taken_once_whatever_comes(order: list[int], named: int) -> None:
    """Here from the first on, and with a state somewhere in between."""
    sequence = SequenceTracker(order[0] - 1, history=EVENTS)
    taken = [seq for seq in order[: len(order) // 2] if sequence.record(seq, 0.0)]
    sequence.announce_up_to(named, 0.0)
    taken += [seq for seq in order[len(order) // 2 :] if sequence.record(seq, 0.0)]
    assert sorted(taken) == sorted(set(order))
    last = max(*order, named)
    assert sequence.missing == last - len(taken)
    taken += ask_all(sequence, Robot(EVENTS, EVENTS))
    assert sequence.missing == sequence.missed == 0
    assert sorted(taken) == list(range(1, len(taken) + 1))
    assert len(taken) >= last


@given(numbers, st.integers(1, EVENTS), st.integers(0, EVENTS))
def test_what_is_kept_no_more_is_missed_if_it_was_told_since(
    order: list[int], kept: int, history: int
) -> None:
    """What was before is no loss, and what comes late is none any more."""
    sequence = SequenceTracker(order[0] - 1, history)
    taken = {seq for seq in order if sequence.record(seq, 0.0)}
    robot = Robot(EVENTS, kept)
    taken |= set(ask_all(sequence, robot))
    assert sequence.missing == 0
    gone = set(range(order[0], max(taken))) - taken
    assert sequence.missed == len(gone)
    assert all(seq < robot.oldest for seq in gone)
    late = set(range(1, EVENTS + 1)) - taken
    assert {seq for seq in late if sequence.record(seq, 0.0)} == late
    assert sequence.missed == 0


@given(st.lists(st.integers(0, EVENTS), max_size=10), st.integers(0, EVENTS))
def test_a_number_that_never_was_does_no_harm(lies: list[int], message: int) -> None:
    """The robot denies it, and its events are taken as they come."""
    sequence = SequenceTracker(0)
    taken: deque[int] = deque()
    for seq in range(1, message + 1):
        assert sequence.record(seq, 0.0)
        taken.append(seq)
        for lie in lies:
            sequence.announce_up_to(lie, 0.0)
        taken += ask_all(sequence, Robot(seq, EVENTS))
        assert sequence.missing == sequence.missed == 0
    assert list(taken) == list(range(1, message + 1))


def test_history_is_wanted_as_far_back_as_asked() -> None:
    """And no further, though what comes from before is taken, too."""
    sequence = SequenceTracker(100, history=30)
    assert sequence.missing == 30
    assert sequence.due(0.0) == 71
    assert sequence.missed == 0
    assert sequence.record(50, 0.0)
    assert not sequence.record(50, 0.0)
    assert SequenceTracker(100).due(0.0) is None


def test_an_event_that_a_state_names_may_be_on_its_way() -> None:
    """It is asked for after a second; one that was skipped by another, at once."""
    sequence = SequenceTracker(10)
    sequence.announce_up_to(12, 100.0)
    assert sequence.due(100.9) is None
    assert sequence.due(101.0) == 11
    sequence.record(11, 100.5)
    sequence.record(12, 100.5)
    assert sequence.due(200.0) is None
    sequence.record(15, 100.5)
    assert sequence.due(100.5) == 13


def test_a_gap_is_given_up_after_some_tries() -> None:
    """Its events are missed then, and no loss any more if they come after all."""
    sequence = SequenceTracker(10)
    sequence.record(15, 0.0)
    for _ in range(TRIES):
        assert sequence.due(0.0) == 11
        sequence.handle_no_reply(11)
    assert sequence.due(0.0) is None
    assert (sequence.missing, sequence.missed) == (0, 4)
    assert sequence.record(12, 0.0)
    assert sequence.missed == 3


def test_a_useful_answer_gives_the_rest_new_tries() -> None:
    """As long as there is progress it is asked on."""
    sequence = SequenceTracker(0)
    sequence.record(100, 0.0)
    for seq in range(1, 100):
        for _ in range(TRIES - 1):
            sequence.handle_no_reply(seq)
        assert sequence.due(0.0) == seq
        sequence.record(seq, 0.0)
    assert sequence.missed == 0


def test_a_life_that_is_over_is_asked_nothing() -> None:
    """What is missing then is missed, unless it was from before."""
    sequence = SequenceTracker(10, history=5)
    sequence.record(14, 0.0)
    sequence.close()
    assert sequence.due(1e9) is None
    assert sequence.missed == 3
    assert sequence.fill_gap(12)
    assert not sequence.fill_gap(15)


def test_gaps_take_little_memory_however_many_there_are() -> None:
    """The oldest are closed: what is in them is missed for good."""
    sequence = SequenceTracker(0)
    for seq in range(1, 20_001, 2):
        assert sequence.record(seq, 0.0)
    assert sequence.missed == 9_999
    assert sequence.missing == MAX_GAPS
    assert not sequence.record(2, 0.0)
    assert sequence.record(19_998, 0.0)
    assert not sequence.record(19_998, 0.0)
