"""Finds damage in the file of a robot: every row carries a digest, and the head one over all of them."""

import sqlite3
from dataclasses import dataclass
from pathlib import Path

from crcolony.storage.sql import _DIGEST_BYTES, StorageError, digest_of, select


@dataclass
class Head:
    """The row of `memory`: what the whole file must agree with."""

    robot: str
    schema: bytes
    life: int = 0
    serial: int = 0
    newest: int = 0
    older: int = 0
    total: bytes = bytes(_DIGEST_BYTES)
    layout: bytes = b""

    def base(self, damaged: frozenset[int]) -> int:
        """Return the serial of the snapshot that the robot goes on from: the newest undamaged one, or 0."""
        return self.older if self.newest in damaged else self.newest

    def include(self, digest: bytes) -> None:
        """Count a row in, or out if it was in."""
        total = int.from_bytes(self.total) ^ int.from_bytes(digest)
        self.total = total.to_bytes(_DIGEST_BYTES)


@dataclass(frozen=True)
class Checked:
    """What a look at the whole file found: its head, and the serials of its damaged snapshots."""

    head: Head
    damaged: frozenset[int]


def check(database: sqlite3.Connection, path: Path) -> Checked:
    """Look at every page and row; raises StorageError for any damage that is not to a snapshot."""
    for (finding,) in database.execute("PRAGMA integrity_check(1)"):
        if finding != "ok":
            raise StorageError(f"{path}: corrupt: {finding.splitlines()[0]}")
    rows = list(select(database, "SELECT * FROM memory"))
    if len(rows) != 1 or rows[0].pop("digest") != digest_of("memory", rows[0]):
        raise StorageError(f"{path}: corrupt: the row of table memory is damaged")
    head = Head(**rows[0])
    if head.layout != _layout(database):
        raise StorageError(f"{path}: corrupt: its tables are not as they were")
    found = Head(head.robot, head.schema)
    for table in ("encounters", "events"):
        for seq, row in enumerate(select(database, f"SELECT * FROM {table} ORDER BY seq"), 1):
            if row["seq"] != seq or row["digest"] != digest_of(table, row):
                raise StorageError(
                    f"{path}: corrupt: row {seq} of table {table} is damaged or lost"
                )
            found.include(row["digest"])
    if found.total != head.total:
        raise StorageError(f"{path}: corrupt: rows are missing, or of different moments")
    return Checked(head, _damaged_snapshots(database, head, path))


def _damaged_snapshots(database: sqlite3.Connection, head: Head, path: Path) -> frozenset[int]:
    serials, damaged = set(), set()
    for row in select(database, "SELECT * FROM snapshots"):
        serials.add(row["serial"])
        if row["digest"] != digest_of("snapshots", row):
            damaged.add(row["serial"])
    if serials != {head.newest, head.older} - {0}:
        raise StorageError(f"{path}: corrupt: a snapshot is missing, or of another moment")
    if serials and serials == damaged:
        raise StorageError(f"{path}: corrupt: no snapshot is undamaged")
    return frozenset(damaged)


def _layout(database: sqlite3.Connection) -> bytes:
    """Return a digest of the tables' definitions; what an analyst adds (an index, a view) does not matter."""
    query = "SELECT name, sql FROM sqlite_schema WHERE type = 'table' AND name IN (?, ?, ?, ?)"
    tables = database.execute(query, ("memory", "encounters", "events", "snapshots")).fetchall()
    return digest_of("sqlite_schema", dict(tables))
