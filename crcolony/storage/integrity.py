"""Finds damage in a robot's file: every row carries a digest, and the head a digest over all of them.

SQLite checksums its log but not the main file. A flipped bit, a lost row, and pages of two different moments are all
found here. Snapshots are the exception: two are kept, so a damaged one is reported, and the other is used.
"""

import sqlite3
from dataclasses import dataclass
from pathlib import Path

from crcolony.storage.sql import DIGEST_BYTES, StorageError, digest_of, select


@dataclass(frozen=True)
class Names:
    """What a version of the schema calls the table of the head, and the column of a robot's starts in it."""

    head: str
    incarnation: str


NAMES_OF_VERSION_1 = Names("memory", "life")
NAMES = Names("head", "incarnation")
"""Those of the present version."""


@dataclass
class Head:
    """The one row of table `head`, which the whole file must agree with."""

    robot: str
    schema: bytes
    incarnation: int = 0
    serial: int = 0
    newest: int = 0
    older: int = 0
    total: bytes = bytes(DIGEST_BYTES)
    layout: bytes = b""

    def base_serial(self, damaged: frozenset[int]) -> int:
        """Return the serial of the newest undamaged snapshot, or 0 if there is none."""
        return self.older if self.newest in damaged else self.newest

    def toggle(self, digest: bytes) -> None:
        """Add the digest of a row to the total, or remove it if it is part of the total."""
        total = int.from_bytes(self.total) ^ int.from_bytes(digest)
        self.total = total.to_bytes(DIGEST_BYTES)


@dataclass(frozen=True)
class IntegrityReport:
    """The head of a sound file, and the serials of its damaged snapshots."""

    head: Head
    damaged_snapshots: frozenset[int]


def check_integrity(
    database: sqlite3.Connection, path: Path, names: Names = NAMES
) -> IntegrityReport:
    """Check every page and row; raises StorageError for any damage outside the snapshots."""
    for (finding,) in database.execute("PRAGMA integrity_check(1)"):
        if finding != "ok":
            raise StorageError(f"{path}: corrupt: {finding.splitlines()[0]}")
    head = _check_head(database, path, names)
    found = Head(head.robot, head.schema)
    for table in ("encounters", "events"):
        for seq, row in enumerate(select(database, f"SELECT * FROM {table} ORDER BY seq"), 1):
            if row["seq"] != seq or row["digest"] != digest_of(table, row):
                raise StorageError(
                    f"{path}: corrupt: row {seq} of table {table} is damaged or lost"
                )
            found.toggle(row["digest"])
    if found.total != head.total:
        raise StorageError(f"{path}: corrupt: rows are missing, or of different moments")
    return IntegrityReport(head, _damaged_snapshots(database, head, path))


def _check_head(database: sqlite3.Connection, path: Path, names: Names) -> Head:
    rows = list(select(database, f"SELECT * FROM {names.head}"))
    if len(rows) != 1 or rows[0].pop("digest") != digest_of(names.head, rows[0]):
        raise StorageError(f"{path}: corrupt: the row of table {names.head} is damaged")
    (row,) = rows
    head = Head(incarnation=row.pop(names.incarnation), **row)
    if head.layout != layout_digest(database, names):
        raise StorageError(f"{path}: corrupt: its table definitions were changed")
    return head


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


def layout_digest(database: sqlite3.Connection, names: Names = NAMES) -> bytes:
    """Return a digest of the table definitions; indices and views that a user adds do not count."""
    query = "SELECT name, sql FROM sqlite_schema WHERE type = 'table' AND name IN (?, ?, ?, ?)"
    tables = database.execute(query, (names.head, "encounters", "events", "snapshots")).fetchall()
    return digest_of("sqlite_schema", dict(tables))
