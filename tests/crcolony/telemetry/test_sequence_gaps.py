"""Whatever order, loss and repetition events come in, each is taken once, and in the end none is missing."""

from collections import deque

from hypothesis import given
from hypothesis import strategies as st

from crcolony.telemetry.sequence_gaps import MOST_GAPS, PATIENCE_S, TRIES, SequenceTracker

EVENTS = 40
ANSWER = 5
"""Events in an answer of the robot below"""


class Robot:
    """What a robot has told so far, and keeps of it."""

    def __init__(self, told: int, kept: int) -> None:
        self.told, self.oldest = told, max(1, told - kept + 1)

    def answer(self, gaps: SequenceTracker, first: int) -> list[int]:
        """Let a question be answered; return what was new."""
        start = max(first, self.oldest)
        events = range(start, min(start + ANSWER, self.told + 1))
        new = [seq for seq in events if gaps.record(seq, 0.0)]
        gaps.drop_before(self.oldest)
        gaps.handle_reply(first, is_empty=not events)
        return new


def ask_all(gaps: SequenceTracker, robot: Robot, unix_s: float = PATIENCE_S) -> list[int]:
    """Ask until there is nothing to ask for; return what was new."""
    new: list[int] = []
    while (first := gaps.due(unix_s)) is not None:
        new += robot.answer(gaps, first)
    return new


numbers = st.lists(st.integers(1, EVENTS), min_size=1, max_size=3 * EVENTS)
"""What comes: some of the events, some of them again and again, in any order"""


@given(numbers, st.integers(0, EVENTS))
def test_every_event_is_taken_once_whatever_comes(order: list[int], named: int) -> None:
    """Here from the first on, and with a state somewhere in between."""
    gaps = SequenceTracker(order[0] - 1, history=EVENTS)
    taken = [seq for seq in order[: len(order) // 2] if gaps.record(seq, 0.0)]
    gaps.announce_up_to(named, 0.0)
    taken += [seq for seq in order[len(order) // 2 :] if gaps.record(seq, 0.0)]
    assert sorted(taken) == sorted(set(order))
    last = max(*order, named)
    assert gaps.missing == last - len(taken)
    taken += ask_all(gaps, Robot(EVENTS, EVENTS))
    assert gaps.missing == gaps.missed == 0
    assert sorted(taken) == list(range(1, len(taken) + 1))
    assert len(taken) >= last


@given(numbers, st.integers(1, EVENTS), st.integers(0, EVENTS))
def test_what_is_kept_no_more_is_missed_if_it_was_told_since(
    order: list[int], kept: int, history: int
) -> None:
    """What was before is no loss, and what comes late is none any more."""
    gaps = SequenceTracker(order[0] - 1, history)
    taken = {seq for seq in order if gaps.record(seq, 0.0)}
    robot = Robot(EVENTS, kept)
    taken |= set(ask_all(gaps, robot))
    assert gaps.missing == 0
    gone = set(range(order[0], max(taken))) - taken
    assert gaps.missed == len(gone)
    assert all(seq < robot.oldest for seq in gone)
    late = set(range(1, EVENTS + 1)) - taken
    assert {seq for seq in late if gaps.record(seq, 0.0)} == late
    assert gaps.missed == 0


@given(st.lists(st.integers(0, EVENTS), max_size=10), st.integers(0, EVENTS))
def test_a_number_that_never_was_does_no_harm(lies: list[int], told: int) -> None:
    """The robot denies it, and its events are taken as they come."""
    gaps = SequenceTracker(0)
    taken: deque[int] = deque()
    for seq in range(1, told + 1):
        assert gaps.record(seq, 0.0)
        taken.append(seq)
        for lie in lies:
            gaps.announce_up_to(lie, 0.0)
        taken += ask_all(gaps, Robot(seq, EVENTS))
        assert gaps.missing == gaps.missed == 0
    assert list(taken) == list(range(1, told + 1))


def test_history_is_wanted_as_far_back_as_asked() -> None:
    """And no further, though what comes from before is taken, too."""
    gaps = SequenceTracker(100, history=30)
    assert gaps.missing == 30
    assert gaps.due(0.0) == 71
    assert gaps.missed == 0
    assert gaps.record(50, 0.0)
    assert not gaps.record(50, 0.0)
    assert SequenceTracker(100).due(0.0) is None


def test_an_event_that_a_state_names_may_be_on_its_way() -> None:
    """It is asked for after a second; one that was skipped by another, at once."""
    gaps = SequenceTracker(10)
    gaps.announce_up_to(12, 100.0)
    assert gaps.due(100.9) is None
    assert gaps.due(101.0) == 11
    gaps.record(11, 100.5)
    gaps.record(12, 100.5)
    assert gaps.due(200.0) is None
    gaps.record(15, 100.5)
    assert gaps.due(100.5) == 13


def test_a_gap_is_given_up_after_some_tries() -> None:
    """Its events are missed then, and no loss any more if they come after all."""
    gaps = SequenceTracker(10)
    gaps.record(15, 0.0)
    for _ in range(TRIES):
        assert gaps.due(0.0) == 11
        gaps.handle_no_reply(11)
    assert gaps.due(0.0) is None
    assert (gaps.missing, gaps.missed) == (0, 4)
    assert gaps.record(12, 0.0)
    assert gaps.missed == 3


def test_a_useful_answer_gives_the_rest_new_tries() -> None:
    """As long as there is progress it is asked on."""
    gaps = SequenceTracker(0)
    gaps.record(100, 0.0)
    for seq in range(1, 100):
        for _ in range(TRIES - 1):
            gaps.handle_no_reply(seq)
        assert gaps.due(0.0) == seq
        gaps.record(seq, 0.0)
    assert gaps.missed == 0


def test_a_life_that_is_over_is_asked_nothing() -> None:
    """What is missing then is missed, unless it was from before."""
    gaps = SequenceTracker(10, history=5)
    gaps.record(14, 0.0)
    gaps.close()
    assert gaps.due(1e9) is None
    assert gaps.missed == 3
    assert gaps.fill_gap(12)
    assert not gaps.fill_gap(15)


def test_gaps_take_little_memory_however_many_there_are() -> None:
    """The oldest are closed: what is in them is missed for good."""
    gaps = SequenceTracker(0)
    for seq in range(1, 20_001, 2):
        assert gaps.record(seq, 0.0)
    assert gaps.missed == 9_999
    assert gaps.missing == MOST_GAPS
    assert not gaps.record(2, 0.0)
    assert gaps.record(19_998, 0.0)
    assert not gaps.record(19_998, 0.0)
