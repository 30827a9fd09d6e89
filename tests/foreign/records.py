"""What a robot must not forget (PROTOCOL.md, "Records"), in SQLite, every write safe from a power cut."""

import sqlite3
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Final

Encounter = tuple[bytes, bytes, int, int]
"""Initiator, responder, incarnation, count."""

SCHEMA: Final = """
CREATE TABLE IF NOT EXISTS encounters (
  initiator BLOB, responder BLOB, incarnation INTEGER, count INTEGER,
  role TEXT, state TEXT, nonce INTEGER, tick INTEGER,
  agent TEXT, genes BLOB, partner_agent TEXT, partner_genes BLOB, proof BLOB, is_orphaned INTEGER, conceived INTEGER,
  PRIMARY KEY (initiator, responder, incarnation, count)) STRICT;
CREATE INDEX IF NOT EXISTS marks ON encounters (role, initiator, incarnation, count);
CREATE TABLE IF NOT EXISTS offspring (
  number INTEGER PRIMARY KEY, genes BLOB, mother TEXT, father TEXT, is_born INTEGER) STRICT;
CREATE TABLE IF NOT EXISTS facts (name TEXT PRIMARY KEY, value BLOB) STRICT;
"""


@dataclass
class Record:
    """One encounter at this robot."""

    encounter: Encounter
    role: str
    state: str
    nonce: int
    tick: int
    agent: str
    genes: bytes
    partner_agent: str = ""
    partner_genes: bytes = b""
    proof: bytes = b""
    is_orphaned: bool = False
    conceived: bool = False

    @property
    def partner(self) -> bytes:
        return self.encounter[1] if self.role == "initiator" else self.encounter[0]

    @property
    def number(self) -> tuple[int, int]:
        return self.encounter[2:]


FIELDS: Final = tuple(field.name for field in fields(Record) if field.name != "encounter")
"""The columns after those of the encounter, in their order."""


class Records:
    """The robot's disk."""

    def __init__(self, path: Path) -> None:
        self._database = sqlite3.connect(path, isolation_level=None)
        self._database.execute("PRAGMA journal_mode = WAL")
        self._database.execute("PRAGMA synchronous = FULL")
        self._database.executescript(SCHEMA)

    @contextmanager
    def write(self) -> Iterator[None]:
        """One transaction: all of it is on disk after the `with`, or none."""
        self._database.execute("BEGIN IMMEDIATE")
        try:
            yield
            self._database.execute("COMMIT")
        except BaseException:
            self._database.execute("ROLLBACK")
            raise

    def next_incarnation(self) -> int:
        """Above every earlier one, even after a copy of the disk was put back: the clock gives it."""
        with self.write():
            incarnation = max(int(self.fact("incarnation") or b"0") + 1, int(time.time()))
            self.set_fact("incarnation", str(incarnation).encode())
        return incarnation

    def fact(self, name: str) -> bytes | None:
        row = self._database.execute("SELECT value FROM facts WHERE name = ?", (name,)).fetchone()
        return None if row is None else bytes(row[0])

    def set_fact(self, name: str, value: bytes) -> None:
        self._database.execute("INSERT OR REPLACE INTO facts VALUES (?, ?)", (name, value))

    def put(self, record: Record) -> None:
        holes = ", ".join("?" * (4 + len(FIELDS)))
        values = (*record.encounter, *(getattr(record, name) for name in FIELDS))
        self._database.execute(f"INSERT OR REPLACE INTO encounters VALUES ({holes})", values)

    def open(self) -> list[Record]:
        return self._records("state IN ('DECIDED', 'PREPARED')")

    def matings(self) -> list[Record]:
        return self._records("state = 'MATED'")

    def last_prepared(self, initiator: bytes) -> Record | None:
        """The initiator's mark: its highest encounter for which this robot was prepared, for good."""
        condition = (
            "role = 'responder' AND initiator = ? ORDER BY incarnation DESC, count DESC LIMIT 1"
        )
        found = self._records(condition, initiator)
        return found[0] if found else None

    def _records(self, condition: str, *values: object) -> list[Record]:
        rows = self._database.execute(
            f"SELECT * FROM encounters WHERE {condition}", values
        ).fetchall()
        return [
            Record((r[0], r[1], r[2], r[3]), **dict(zip(FIELDS, r[4:], strict=True))) for r in rows
        ]

    def counts(self) -> tuple[int, int]:
        """Matings and conceptions in all incarnations."""
        query = "SELECT count(*), coalesce(sum(conceived), 0) FROM encounters WHERE state IN ('MATED', 'DECIDED')"
        matings, conceptions = self._database.execute(query).fetchone()
        return matings, conceptions

    def conceive(self, genes: bytes, mother: str, father: str) -> None:
        insert = "INSERT INTO offspring (genes, mother, father, is_born) VALUES (?, ?, ?, 0)"
        self._database.execute(insert, (genes, mother, father))

    def pool(self) -> int:
        return int(
            self._database.execute("SELECT count(*) FROM offspring WHERE is_born = 0").fetchone()[0]
        )

    def next_offspring(self) -> tuple[int, bytes, str, str] | None:
        """The one that has waited longest: its number, genes, mother and father."""
        query = (
            "SELECT number, genes, mother, father FROM offspring WHERE is_born = 0 ORDER BY number"
        )
        row = self._database.execute(f"{query} LIMIT 1").fetchone()
        return None if row is None else (row[0], row[1], row[2], row[3])

    def take_from_pool(self, number: int) -> None:
        self._database.execute("UPDATE offspring SET is_born = 1 WHERE number = ?", (number,))

    def close(self) -> None:
        self._database.close()
