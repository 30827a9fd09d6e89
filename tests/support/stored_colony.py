"""The files that robots would have of the history of an in-process colony."""

from pathlib import Path

import msgspec

from crcolony.evolution.history import Event, Mated
from crcolony.protocol.encounters import EncounterRecord, Offer, Role
from crcolony.protocol.mating_messages import Encounter
from crcolony.storage.rows import Decision
from crcolony.storage.store import RobotStore

SCHEMA = bytes(16)


def id_of(number: int) -> bytes:
    """Return a robot's id; ids are not in the order of numbers."""
    return bytes([255 - number]) * 16


def named(agent: str | None) -> str | None:
    """Return an agent's name with the id of its robot in place of the number."""
    if agent is None:
        return None
    number, _, own = agent.partition("/")
    return f"{id_of(int(number)).hex()}/{own}"


def write_robots(folder: Path, events: list[Event], robots: int) -> list[Path]:
    """Write the file of every robot of a history into folder/robots/N; return their paths."""
    paths = []
    for number in range(robots):
        path = folder / "robots" / str(number) / "robot.sqlite"
        path.parent.mkdir(parents=True)
        store = RobotStore(path, id_of(number), SCHEMA, durable=False)
        count = 0
        for event in events:
            if isinstance(event, Mated):
                count += 1
                if number in (event.robot, event.partner_robot):
                    _write_mating(store, event, number, count)
        own = [_renamed(e) for e in events if not isinstance(e, Mated) and e.robot == number]
        store.save({"generation": 0}, own, tick=max(event.tick for event in own))
        store.close()
        paths.append(path)
    return paths


def _write_mating(store: RobotStore, mated: Mated, number: int, count: int) -> None:
    """Write one side of a mating, which its first robot has proposed."""
    encounter = Encounter(id_of(mated.robot), id_of(mated.partner_robot), 1, count)
    is_first = number == mated.robot
    offers = [Offer(named(agent) or "", b"") for agent in (mated.agent, mated.partner)]
    own, partner = offers if is_first else offers[::-1]
    role: Role = "initiator" if is_first else "responder"
    record = EncounterRecord(encounter, role, "mated", 1, mated.tick, own, partner, b"")
    energy = mated.energy if is_first else mated.partner_energy
    conceived = mated.conceived if is_first else mated.partner_conceived
    store.write([record], record, Decision(energy, conceived, False, b"", 0, bytes(16)))


def _renamed(event: Event) -> Event:
    changes = {
        field: named(getattr(event, field))
        for field in ("agent", "mother", "father")
        if hasattr(event, field)
    }
    return msgspec.structs.replace(event, **changes)
