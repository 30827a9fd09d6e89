"""The history of a colony, merged from its robots' files, which hold a part each, in the order of ticks.

Robots and their agents are named by the robots' numbers. So the history of robots in their own processes and that of an
in-process colony are the same events, with the same hash.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec

from crcolony.evolution.history import Born, Died, Event, HistoryHash, Lived, Mated, TurnedOver
from crcolony.protocol.encounters import EncounterRecord
from crcolony.protocol.identity import RobotId
from crcolony.protocol.mating_messages import Encounter
from crcolony.storage.reading import StoredRobot, read_stored_robot
from crcolony.storage.rows import Decision

_ORDER: dict[type, int] = {Died: 0, Mated: 1, TurnedOver: 2, Lived: 2, Born: 3}
"""The order of events within a tick, as in an in-process colony."""


@dataclass(frozen=True)
class OneSidedMating:
    """A mating that only one robot's file holds: the other file is not there, or does not hold it yet."""

    robot: RobotId
    record: EncounterRecord
    decision: Decision


@dataclass(frozen=True)
class MergedHistory:
    """The history of all robots together."""

    robots: tuple[RobotId, ...]
    """Ids in the order of the robots' numbers"""
    events: tuple[Event, ...]
    one_sided: tuple[OneSidedMating, ...]

    @property
    def hash(self) -> HistoryHash:
        """The hash of the history, equal to that of an in-process colony with the same history."""
        chain = HistoryHash()
        for event in self.events:
            chain.add(event)
        return chain


def merge_robot_files(paths: Sequence[Path]) -> MergedHistory:
    """Read robots' files and merge them; raises StorageError."""
    return merge_robots([read_stored_robot(path) for path in paths])


def merge_robots(stored_robots: Sequence[StoredRobot]) -> MergedHistory:
    """Merge what robots' files hold; robots are numbered by their own number, then by id."""
    stored_robots = sorted(stored_robots, key=lambda stored: (_number_of(stored), stored.robot))
    numbers = {stored.robot.hex(): number for number, stored in enumerate(stored_robots)}
    events: list[tuple[int, int, int, Event]] = []
    for number, stored in enumerate(stored_robots):
        for event in stored.events:
            renamed = _renamed(event, number, numbers)
            events.append((event.tick, _ORDER[type(event)], number, renamed))
    matings, one_sided = _pair(stored_robots, numbers)
    events += [(mated.tick, _ORDER[Mated], mated.robot, mated) for mated in matings]
    events.sort(key=lambda entry: entry[:3])
    return MergedHistory(
        tuple(stored.robot for stored in stored_robots),
        tuple(entry[3] for entry in events),
        tuple(one_sided),
    )


def _number_of(stored: StoredRobot) -> int:
    return min((event.robot for event in stored.events if not isinstance(event, Mated)), default=0)


def _renamed(event: Event, number: int, numbers: Mapping[str, int]) -> Event:
    """Return an event of the robot with this number, with all robots and agents named by numbers."""
    changes: dict[str, object] = {} if isinstance(event, Mated) else {"robot": number}
    for field in ("agent", "mother", "father"):
        name = getattr(event, field, None)
        if name is not None:
            changes[field] = agent_by_number(name, numbers)
    return msgspec.structs.replace(event, **changes)


def agent_by_number(name: str, numbers: Mapping[str, int]) -> str:
    """Return an agent's name with the number of its robot in place of the id; unchanged if the robot has no number."""
    robot, slash, own = name.partition("/")
    return f"{numbers[robot]}{slash}{own}" if robot in numbers else name


def _pair(
    stored_robots: Sequence[StoredRobot], numbers: Mapping[str, int]
) -> tuple[list[Mated], list[OneSidedMating]]:
    """Return the matings that both sides hold, as an in-process colony records them, and those of one side only."""
    sides: dict[Encounter, dict[RobotId, tuple[EncounterRecord, Decision]]] = {}
    for stored in stored_robots:
        for record, decision in stored.matings:
            if decision is not None:
                sides.setdefault(record.encounter, {})[stored.robot] = (record, decision)
    matings, one_sided = [], []
    for both in sides.values():
        first, *others = sorted(both, key=lambda robot: numbers[robot.hex()])
        if not others:
            one_sided.append(OneSidedMating(first, *both[first]))
            continue
        (record, decision), (_, other) = both[first], both[others[0]]
        assert record.partner is not None, "a decided encounter has a partner"
        matings.append(
            Mated(
                tick=record.tick,
                robot=numbers[first.hex()],
                partner_robot=numbers[others[0].hex()],
                agent=agent_by_number(record.own.agent, numbers),
                partner=agent_by_number(record.partner.agent, numbers),
                energy=decision.energy,
                partner_energy=other.energy,
                conceived=decision.conceived,
                partner_conceived=other.conceived,
            )
        )
    return matings, one_sided
