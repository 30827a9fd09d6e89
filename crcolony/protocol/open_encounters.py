"""The encounters of one robot that wait for their partner, with their timers."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

from crcolony.protocol.encounters import EncounterRecord, EncounterState, MatingLimits
from crcolony.protocol.identity import RobotId
from crcolony.protocol.mating_messages import Encounter


@dataclass(frozen=True)
class OpenEncounter:
    """An encounter that waits for its partner."""

    record: EncounterRecord
    retry_at_s: float
    give_up_at_s: float
    retry_interval_s: float
    in_doubt: bool = False
    """The responder has waited so long for the decision that it asks for it and is free for other robots"""

    @property
    def is_engaging(self) -> bool:
        """Whether the robot begins no other encounter because of this one."""
        return self.record.state in ("proposed", "prepared") and not self.in_doubt


class OpenEncounters:
    """The open encounters of one robot, in the order in which they were added."""

    def __init__(self, limits: MatingLimits) -> None:
        self._limits = limits
        self._encounters: dict[Encounter, OpenEncounter] = {}

    def __iter__(self) -> Iterator[OpenEncounter]:
        return iter(tuple(self._encounters.values()))

    def __len__(self) -> int:
        return len(self._encounters)

    def __contains__(self, encounter: Encounter) -> bool:
        return encounter in self._encounters

    def copy(self) -> "OpenEncounters":
        """Return an independent copy."""
        other = OpenEncounters(self._limits)
        other._encounters = self._encounters.copy()
        return other

    def add(self, record: EncounterRecord, now_s: float, in_doubt: bool = False) -> None:
        """Add an encounter, or replace its record, and start its timers. Only one that is prepared can be in doubt."""
        limits = self._limits
        is_prepared = record.state == "prepared"
        interval_s = limits.doubt_s if is_prepared else limits.retry_s
        give_up_s = limits.propose_s if record.state == "proposed" else limits.orphan_s
        if record.orphaned:
            interval_s, give_up_s = limits.max_retry_s, float("inf")
        self._encounters[record.encounter] = OpenEncounter(
            record, now_s + interval_s, now_s + give_up_s, interval_s, in_doubt and is_prepared
        )

    def __getitem__(self, encounter: Encounter) -> OpenEncounter:
        return self._encounters[encounter]

    def get(self, encounter: Encounter) -> OpenEncounter | None:
        """Return an encounter, None if it is not open."""
        return self._encounters.get(encounter)

    def discard(self, encounter: Encounter) -> None:
        """Remove an encounter if it is open."""
        self._encounters.pop(encounter, None)

    def schedule_retry(self, encounter: Encounter, now_s: float) -> None:
        """Double the interval of an encounter's retries. A responder that must ask for the decision is in doubt."""
        entry = self._encounters[encounter]
        interval_s = min(2.0 * entry.retry_interval_s, self._limits.max_retry_s)
        self._encounters[encounter] = replace(
            entry,
            retry_at_s=now_s + interval_s,
            retry_interval_s=interval_s,
            in_doubt=entry.record.state == "prepared",
        )

    def with_peer(self, peer: RobotId) -> list[OpenEncounter]:
        """Return the encounters with a peer."""
        return [entry for entry in self if entry.record.peer == peer]

    def record_of(self, peer: RobotId, state: EncounterState) -> EncounterRecord | None:
        """Return the first record with this peer in this state, None if there is none."""
        records = (entry.record for entry in self.with_peer(peer))
        return next((record for record in records if record.state == state), None)

    def may_add(self, peer: RobotId, replacing: EncounterRecord | None = None) -> bool:
        """Return whether an encounter with this peer may begin, perhaps replacing another with it.

        It may not while another encounter is in progress, while one with this peer is open, or when there is no room.
        """
        others = [entry for entry in self if entry.record is not replacing]
        is_free = not any(entry.is_engaging or entry.record.peer == peer for entry in others)
        return is_free and len(others) < self._limits.open

    @property
    def is_engaged(self) -> bool:
        """Whether an encounter keeps this robot from beginning another."""
        return any(entry.is_engaging for entry in self)

    @property
    def doubts(self) -> int:
        """Number of encounters in doubt."""
        return sum(entry.in_doubt for entry in self)

    @property
    def next_s(self) -> float:
        """Time of the next retry or give-up, infinity without any."""
        times = (min(entry.retry_at_s, entry.give_up_at_s) for entry in self)
        return min(times, default=float("inf"))
