"""Which events of one life of a robot have come, and which are missing: numbers only, in whatever order they come."""

from dataclasses import dataclass, replace

PATIENCE_S = 1.0
"""An event that a state names may be on its way for so long before anybody asks for it."""
TRIES = 3
"""So many questions without a useful answer, and a gap is given up."""
MAX_GAPS = 100
"""Beyond it the oldest is closed: gaps take memory, and anybody can make them."""


@dataclass(frozen=True, slots=True)
class Gap:
    """Events that have not come, from the first to the last."""

    first: int
    last: int
    due_s: float = 0.0
    """When to ask for them"""
    is_wanted: bool = True
    """Whether to ask at all"""
    is_missed: bool = True
    """Whether they are a loss: what was before the observer came, or never was, is none"""
    tries: int = 0

    @property
    def size(self) -> int:
        """How many there are."""
        return self.last - self.first + 1

    def part(self, first: int, last: int) -> list["Gap"]:
        """Return what of it lies within the given numbers; a part is a gap that nobody asked for yet."""
        first, last = max(first, self.first), min(last, self.last)
        if first > last:
            return []
        is_whole = (first, last) == (self.first, self.last)
        return [self if is_whole else replace(self, first=first, last=last, tries=0)]


class SequenceTracker:
    """Follows the numbers of one life from `seen`, the last that there was; of those before, `history` are wanted.

    A number that has come is never taken again, and one that has not is, however late. Gaps are in order and apart.
    """

    def __init__(self, seen: int, history: int = 0) -> None:
        self.last = seen
        """The latest that is known of"""
        self._closed = 0
        """Missed in gaps that were closed"""
        before = Gap(1, seen, is_missed=False)
        self._open_gaps = [
            *(replace(gap, is_wanted=False) for gap in before.part(1, seen - history)),
            *before.part(seen - history + 1, seen),
        ]

    @property
    def missing(self) -> int:
        """How many events are wanted and have not come."""
        return sum(gap.size for gap in self._open_gaps if gap.is_wanted)

    @property
    def missed(self) -> int:
        """How many events were told, or named, and have not come."""
        return self._closed + sum(gap.size for gap in self._open_gaps if gap.is_missed)

    def due(self, unix_s: float) -> int | None:
        """Return the first event to ask for now, if there is one."""
        for gap in self._open_gaps:
            if gap.is_wanted and gap.due_s <= unix_s:
                return gap.first
        return None

    # What comes ----------------------------------------------------------------------------------------------------

    def record(self, seq: int, unix_s: float) -> bool:
        """Take an event; tell whether it is new. What it skips is missing from now on."""
        if seq <= self.last:
            return self.fill_gap(seq)
        self._add_gap(seq - 1, unix_s)
        self.last = seq
        return True

    def fill_gap(self, seq: int) -> bool:
        """Take an event that is known not to have come; tell whether it was."""
        for place, gap in enumerate(self._open_gaps):
            if gap.first <= seq <= gap.last:
                self._open_gaps[place : place + 1] = [
                    *gap.part(gap.first, seq - 1),
                    *gap.part(seq + 1, gap.last),
                ]
                self._make_room()
                return True
        return False

    def announce_up_to(self, seq: int, unix_s: float) -> None:
        """Hear that there have been events up to a number."""
        self._add_gap(seq, unix_s + PATIENCE_S)

    def _add_gap(self, last: int, due_s: float) -> None:
        """Miss what comes after the latest that is known of, up to a number."""
        if last <= self.last:
            return
        before = self._open_gaps[-1] if self._open_gaps else None
        if before and before.last == self.last and before.is_wanted and before.is_missed:
            self._open_gaps[-1] = replace(before, last=last)
        else:
            self._open_gaps.append(Gap(self.last + 1, last, due_s))
        self.last = last
        self._make_room()

    def _make_room(self) -> None:
        while len(self._open_gaps) > MAX_GAPS:
            closed = self._open_gaps.pop(0)
            self._closed += closed.size if closed.is_missed else 0

    # What is asked -------------------------------------------------------------------------------------------------

    def handle_reply(self, first: int, is_empty: bool) -> None:
        """Hear that a question for events from `first` on was answered, after what the answer holds was taken.

        If it holds nothing there are none from `first` on: who named them was wrong.
        """
        if is_empty:
            self._remove_from(first)
        else:
            self.handle_no_reply(first)

    def handle_no_reply(self, first: int) -> None:
        """Hear that a question for events from `first` on was of no use; nothing happens if that one has come."""
        for place, gap in enumerate(self._open_gaps):
            if gap.first == first and gap.is_wanted:
                tries = gap.tries + 1
                is_over = tries >= TRIES
                self._open_gaps[place] = replace(
                    gap, tries=tries, is_wanted=not is_over, is_missed=gap.is_missed or is_over
                )

    def drop_before(self, oldest: int) -> None:
        """Hear that nobody keeps what is older than this: it need not be asked for."""
        sequence: list[Gap] = []
        for gap in self._open_gaps:
            sequence += [replace(gone, is_wanted=False) for gone in gap.part(1, oldest - 1)]
            sequence += gap.part(oldest, gap.last)
        self._open_gaps = sequence
        self._make_room()

    def close(self) -> None:
        """Hear that the life is over, and its events with it."""
        self.drop_before(self.last + 1)

    def _remove_from(self, first: int) -> None:
        """Miss nothing from a number on; above the latest that has come, it is as if nobody had named any."""
        while (
            self._open_gaps
            and self._open_gaps[-1].last == self.last
            and self._open_gaps[-1].first >= first
        ):
            self.last = self._open_gaps.pop().first - 1
        self._open_gaps = [
            replace(gap, is_wanted=False, is_missed=False) if gap.first >= first else gap
            for gap in self._open_gaps
        ]
