"""The encounters of a robot that have not ended, and their timers (PROTOCOL.md, "Timers and limits")."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from tests.foreign.records import Encounter, Record

PROPOSE_S: Final = 2.0
RETRY_S: Final = 0.2
DOUBT_S: Final = 0.5
MAX_RETRY_S: Final = 5.0
ORPHAN_S: Final = 60.0
MOST_OPEN: Final = 256


@dataclass
class Open:
    """One of them."""

    record: Record
    began_s: float
    interval_s: float
    retry_s: float
    is_in_doubt: bool = False

    @property
    def is_engaging(self) -> bool:
        """Rule 2: with it the robot begins nothing with a third one."""
        state = self.record.state
        return state == "PROPOSED" or (state == "PREPARED" and not self.is_in_doubt)

    def is_hopeless(self, now_s: float) -> bool:
        limit_s = PROPOSE_S if self.record.state == "PROPOSED" else ORPHAN_S
        return not self.record.is_orphaned and now_s >= self.began_s + limit_s

    def wait_longer(self, now_s: float) -> None:
        self.interval_s = min(MAX_RETRY_S, 2.0 * self.interval_s)
        self.retry_s = now_s + self.interval_s


class OpenEncounters:
    """All of them, by their number."""

    def __init__(self) -> None:
        self._open: dict[Encounter, Open] = {}

    def __iter__(self) -> Iterator[Open]:
        return iter(list(self._open.values()))

    def get(self, encounter: Encounter) -> Open | None:
        return self._open.get(encounter)

    def begin(self, record: Record, now_s: float) -> Open:
        interval_s = DOUBT_S if record.state == "PREPARED" else RETRY_S
        opened = Open(record, now_s, interval_s, now_s + interval_s)
        self._open[record.encounter] = opened
        return opened

    def end(self, opened: Open) -> None:
        del self._open[opened.record.encounter]

    def of(self, partner: bytes, state: str) -> Open | None:
        """The one with this partner in this state; there is one at most."""
        return next((one for one in self.with_(partner) if one.record.state == state), None)

    def with_(self, partner: bytes) -> list[Open]:
        return [one for one in self if one.record.partner == partner]

    def have_room_for(self, partner: bytes, instead_of: Open | None = None) -> bool:
        """Rules 2 and 3: whether an encounter with this partner may begin, perhaps instead of another with it."""
        others = [one for one in self if one is not instead_of]
        is_free = not any(one.is_engaging or one.record.partner == partner for one in others)
        return is_free and len(others) < MOST_OPEN
