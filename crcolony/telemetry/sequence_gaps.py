"""Which events of one incarnation of a robot have arrived and which are missing, by their sequence numbers."""

from dataclasses import dataclass, replace

REQUEST_DELAY_S = 1.0
"""An event that a state announces may still be on its way: it is not requested before."""
MAX_TRIES = 3
"""Requests without a useful reply after which a gap is given up."""
MAX_GAPS = 100
"""Gaps that are remembered: of more, which anyone can cause, the oldest is closed."""


@dataclass(frozen=True, slots=True)
class Gap:
    """Consecutive events that have not arrived, from the first to the last sequence number."""

    first: int
    last: int
    due_s: float = 0.0
    """When to request them"""
    is_wanted: bool = True
    """Whether to request them at all"""
    is_missed: bool = True
    """Whether they count as missed: events that are older than the monitor, or never existed, do not"""
    tries: int = 0
    """Requests without a useful reply"""

    @property
    def size(self) -> int:
        """Number of events."""
        return self.last - self.first + 1

    def clipped(self, first: int, last: int) -> list["Gap"]:
        """Return the part within two sequence numbers, if there is one; a smaller part has been requested 0 times."""
        first, last = max(first, self.first), min(last, self.last)
        if first > last:
            return []
        is_whole = (first, last) == (self.first, self.last)
        return [self if is_whole else replace(self, first=first, last=last, tries=0)]


class SequenceTracker:
    """Tracks the sequence numbers of one incarnation after event `last`.

    Of the events up to `last` the latest `history` are wanted. A number is accepted once, however late it arrives.
    Gaps are in order and do not touch.
    """

    def __init__(self, last: int, history: int = 0) -> None:
        self.last = last
        """The highest number that is known"""
        self._closed = 0
        """Events missed in gaps that were closed"""
        before = Gap(1, last, is_missed=False)
        self._gaps = [
            *(replace(gap, is_wanted=False) for gap in before.clipped(1, last - history)),
            *before.clipped(last - history + 1, last),
        ]

    @property
    def missing(self) -> int:
        """How many events are wanted and have not arrived."""
        return sum(gap.size for gap in self._gaps if gap.is_wanted)

    @property
    def missed(self) -> int:
        """How many events were published or announced and have not arrived."""
        return self._closed + sum(gap.size for gap in self._gaps if gap.is_missed)

    def first_due(self, unix_s: float) -> int | None:
        """Return the first event to request now, or None."""
        for gap in self._gaps:
            if gap.is_wanted and gap.due_s <= unix_s:
                return gap.first
        return None

    # Events that arrive ----------------------------------------------------------------------------------------------

    def record(self, seq: int, unix_s: float) -> bool:
        """Record an event that arrived; return whether it is new. The numbers that it skips are missing from now on."""
        if seq <= self.last:
            return self.fill_gap(seq)
        self._extend(seq - 1, unix_s)
        self.last = seq
        return True

    def fill_gap(self, seq: int) -> bool:
        """Remove an event that arrived from its gap; return whether it was in one."""
        for index, gap in enumerate(self._gaps):
            if gap.first <= seq <= gap.last:
                self._gaps[index : index + 1] = [
                    *gap.clipped(gap.first, seq - 1),
                    *gap.clipped(seq + 1, gap.last),
                ]
                self._close_oldest()
                return True
        return False

    def announce_up_to(self, seq: int, unix_s: float) -> None:
        """Record that a state names `seq` as the robot's last event."""
        self._extend(seq, unix_s + REQUEST_DELAY_S)

    def _extend(self, last: int, due_s: float) -> None:
        """Add all numbers after the highest known one, up to `last`, to the gaps."""
        if last <= self.last:
            return
        before = self._gaps[-1] if self._gaps else None
        if before and before.last == self.last and before.is_wanted and before.is_missed:
            self._gaps[-1] = replace(before, last=last)
        else:
            self._gaps.append(Gap(self.last + 1, last, due_s))
        self.last = last
        self._close_oldest()

    def _close_oldest(self) -> None:
        while len(self._gaps) > MAX_GAPS:
            closed = self._gaps.pop(0)
            self._closed += closed.size if closed.is_missed else 0

    # Replies ---------------------------------------------------------------------------------------------------------

    def handle_reply(self, first: int, is_empty: bool) -> None:
        """Handle the reply to a request from event `first` on, after its events were recorded.

        An empty reply means that there are no events from `first` on: the announcement was wrong.
        """
        if is_empty:
            self._remove_from(first)
        else:
            self.handle_no_reply(first)

    def handle_no_reply(self, first: int) -> None:
        """Count a try for the gap from event `first` on, unless that event has arrived."""
        for index, gap in enumerate(self._gaps):
            if gap.first == first and gap.is_wanted:
                tries = gap.tries + 1
                is_over = tries >= MAX_TRIES
                self._gaps[index] = replace(
                    gap, tries=tries, is_wanted=not is_over, is_missed=gap.is_missed or is_over
                )

    def drop_before(self, oldest: int) -> None:
        """Stop requesting events before `oldest`: the robot keeps them no longer."""
        gaps: list[Gap] = []
        for gap in self._gaps:
            gaps += [replace(lost, is_wanted=False) for lost in gap.clipped(1, oldest - 1)]
            gaps += gap.clipped(oldest, gap.last)
        self._gaps = gaps
        self._close_oldest()

    def close(self) -> None:
        """Stop requesting events: the incarnation is over, and its events are not kept."""
        self.drop_before(self.last + 1)

    def _remove_from(self, first: int) -> None:
        """Remove gaps from event `first` on; those after the last event that arrived are as if never announced."""
        while self._gaps and self._gaps[-1].last == self.last and self._gaps[-1].first >= first:
            self.last = self._gaps.pop().first - 1
        self._gaps = [
            replace(gap, is_wanted=False, is_missed=False) if gap.first >= first else gap
            for gap in self._gaps
        ]
