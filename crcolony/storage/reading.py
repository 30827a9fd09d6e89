"""Reads the whole of a robot's file, also while the robot runs."""

import sqlite3
from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from crcolony.evolution.history import Event
from crcolony.evolution.population import Offspring
from crcolony.protocol.encounters import EncounterRecord
from crcolony.protocol.identity import RobotId
from crcolony.storage.checkpoint import CheckpointError
from crcolony.storage.files import existing_robot_file
from crcolony.storage.integrity import IntegrityReport, check_integrity
from crcolony.storage.rows import Decision, decision_of, read_snapshot, record_of
from crcolony.storage.schema import check_not_truncated, is_robot_file, migrate
from crcolony.storage.sql import StorageError, connect_read_only, select, storage_errors

_events = msgspec.msgpack.Decoder(Event)


@dataclass(frozen=True)
class StoredRobot:
    """All that a robot's file holds, for inspection and for merging."""

    robot: RobotId
    incarnation: int
    schema: bytes
    matings: list[tuple[EncounterRecord, Decision | None]]
    """All encounters in the order they began, each with the robot's decision if there was a mating"""
    events: list[Event]
    """The robot's history up to the newest undamaged snapshot"""
    tick: int | None
    """The tick of that snapshot, or None if there is no snapshot"""
    saved_unix_s: int | None
    """When that snapshot was written"""
    generation: int | None
    colony: str | None
    """The colony for which the robot's messages are signed"""
    pool: list[Offspring]


def read_stored_robot(path: Path) -> StoredRobot:
    """Read a robot's file, whether the robot runs or not, and change nothing; raises StorageError.

    A file that still has its former name is found under that name.
    """
    path = existing_robot_file(path)
    if not path.is_file():
        raise StorageError(f"{path}: not a crcolony robot file: there is no such file")
    check_not_truncated(path)
    with storage_errors(path), closing(sqlite3.connect(":memory:")) as database:
        # A copy is of one moment, blocks the robot only briefly, and can be migrated to the present version.
        with closing(connect_read_only(path)) as source:
            if not is_robot_file(source, path):
                raise StorageError(f"{path}: not a crcolony robot file: it is empty")
            source.backup(database)
        database.isolation_level = None
        migrate(database, path)
        return _read(database, check_integrity(database, path), path)


def _read(database: sqlite3.Connection, report: IntegrityReport, path: Path) -> StoredRobot:
    head = report.head
    base = head.base_serial(report.damaged_snapshots)
    rows = select(database, "SELECT * FROM encounters ORDER BY seq")
    matings = [(record_of(row), decision_of(row)) for row in rows]
    robot = bytes.fromhex(head.robot)
    if not base:
        return StoredRobot(
            robot, head.incarnation, head.schema, matings, [], None, None, None, None, []
        )
    try:
        saved, snapshot = read_snapshot(database, base)
        query = "SELECT body FROM events WHERE seq <= ? ORDER BY seq"
        bodies = database.execute(query, (snapshot["events"],))
        events = [_events.decode(body) for (body,) in bodies]
    except (CheckpointError, msgspec.DecodeError) as error:
        raise StorageError(f"{path}: corrupt: {error}") from None
    return StoredRobot(
        robot,
        head.incarnation,
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
