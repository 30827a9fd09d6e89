"""Reading the whole of a robot's memory, also while the robot lives."""

import sqlite3
from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

import msgspec
import numpy as np

from crcolony.evolution.history import Event
from crcolony.evolution.population import Offspring
from crcolony.protocol.encounters import EncounterRecord
from crcolony.protocol.identity import RobotId
from crcolony.storage.checkpoint import CheckpointError
from crcolony.storage.integrity import Checked, check
from crcolony.storage.rows import Decision, decision_of, record_of, snapshot_of
from crcolony.storage.schema import migrate, recognise, refuse_emptied
from crcolony.storage.sql import StorageError, named_errors, select

_events = msgspec.msgpack.Decoder(Event)


@dataclass(frozen=True)
class StoredRobot:
    """All that a robot remembers, for those who look or add up."""

    robot: RobotId
    incarnation: int
    schema: bytes
    matings: list[tuple[EncounterRecord, Decision | None]]
    """All encounters, in the order they began; without a decision where it did not come to a mating"""
    events: list[Event]
    """Up to the snapshot"""
    tick: int | None
    """Of the newest undamaged snapshot; None if there is none yet"""
    taken: int | None
    """When that was, in Unix time"""
    generation: int | None
    colony: str | None
    """Its letters are signed for that one"""
    pool: list[Offspring]


def read_stored_robot(path: Path) -> StoredRobot:
    """Read a robot's memory, whether the robot lives or not, and change nothing; raises StorageError."""
    if not path.is_file():
        raise StorageError(f"{path}: not a crcolony robot file: there is no such file")
    refuse_emptied(path)
    with named_errors(path), closing(sqlite3.connect(":memory:")) as database:
        # A copy is of one moment, is out of the robot's way at once, and can be brought to the present version.
        uri = f"file:{quote(str(path.absolute()))}?mode=ro"
        with closing(sqlite3.connect(uri, uri=True)) as source:
            if not recognise(source, path):
                raise StorageError(f"{path}: not a crcolony robot file: it is empty")
            source.backup(database)
        database.isolation_level = None
        migrate(database, path)
        return _store(database, check(database, path), path)


def _store(database: sqlite3.Connection, checked: Checked, path: Path) -> StoredRobot:
    head = checked.head
    base = head.base(checked.damaged)
    rows = select(database, "SELECT * FROM encounters ORDER BY seq")
    matings = [(record_of(row), decision_of(row)) for row in rows]
    robot = bytes.fromhex(head.robot)
    if not base:
        return StoredRobot(robot, head.life, head.schema, matings, [], None, None, None, None, [])
    try:
        saved, snapshot = snapshot_of(database, base)
        query = "SELECT body FROM events WHERE seq <= ? ORDER BY seq"
        bodies = database.execute(query, (snapshot["events"],))
        events = [_events.decode(body) for (body,) in bodies]
    except (CheckpointError, msgspec.DecodeError) as error:
        raise StorageError(f"{path}: corrupt: {error}") from None
    return StoredRobot(
        robot,
        head.life,
        head.schema,
        matings,
        events,
        snapshot["tick"],
        snapshot["taken"],
        saved.get("generation"),
        saved.get("colony"),
        _pool_of(saved),
    )


def _pool_of(saved: Mapping[str, Any]) -> list[Offspring]:
    pool = saved.get("subpopulation", {}).get("pool", [])
    return [
        Offspring(np.array(genes), mother, father, step) for genes, mother, father, step in pool
    ]
