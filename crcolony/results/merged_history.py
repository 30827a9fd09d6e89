"""The history of a colony whose robots each remember their own part: memories put together, in the order of time.

Robots are numbered in the order of their number (then id), and agents are named by it, so that the history of robots in
processes of their own and that of an embedded colony are the same events, with the same hash.
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
"""What comes first in a tick, as in an embedded colony."""


@dataclass(frozen=True)
class OneSidedMating:
    """A mating of which only one robot's memory is here, or that only one of them has (yet)."""

    robot: RobotId
    record: EncounterRecord
    decision: Decision


@dataclass(frozen=True)
class MergedHistory:
    """What a colony's memories say together."""

    robots: tuple[RobotId, ...]
    """In the order of their numbers"""
    events: tuple[Event, ...]
    one_sided: tuple[OneSidedMating, ...]

    @property
    def hash(self) -> HistoryHash:
        """The hash of the history, as that of an embedded colony."""
        chain = HistoryHash()
        for event in self.events:
            chain.add(event)
        return chain


def merge_robot_files(paths: Sequence[Path]) -> MergedHistory:
    """Read memories and put them together; raises StorageError."""
    return merge_robots([read_stored_robot(path) for path in paths])


def merge_robots(stored_robots: Sequence[StoredRobot]) -> MergedHistory:
    """Put memories together."""
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
    """Return an event of the robot with this number, in which robots and agents are called by numbers."""
    changes: dict[str, object] = {} if isinstance(event, Mated) else {"robot": number}
    for field in ("agent", "mother", "father"):
        name = getattr(event, field, None)
        if name is not None:
            changes[field] = agent_by_number(name, numbers)
    return msgspec.structs.replace(event, **changes)


def agent_by_number(name: str, numbers: Mapping[str, int]) -> str:
    """Return an agent's name with its robot's number; of a robot that has none, its name as it is."""
    robot, slash, own = name.partition("/")
    return f"{numbers[robot]}{slash}{own}" if robot in numbers else name


def _pair(
    stored_robots: Sequence[StoredRobot], numbers: Mapping[str, int]
) -> tuple[list[Mated], list[OneSidedMating]]:
    """Return the matings that both sides have, as the embedded colony tells them, and those that one has alone."""
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
        assert record.partner is not None, "what is decided has a partner"
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
