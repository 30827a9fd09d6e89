"""The file of a robot's memory: its tables, how an older file becomes a present one, and how damage to it is found.

    StoreError                a memory cannot be used: the message names the file and the reason

SQLite checksums its log (the WAL) but not the main file. So every row carries a digest over its columns, and the one
row of `memory` a digest over all of those: a flipped bit, a lost row, and pages of two different moments are all found.
A snapshot is the exception: if the newest is damaged there is an older one, so its damage is told, not refused.
"""

import contextlib
import hashlib
import sqlite3
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from crcolony.errors import Refusal

APPLICATION_ID = 0x43524D59  # "CRMY", what `file` shows of a crcolony memory

MIGRATIONS = (
    """
    CREATE TABLE memory (
        robot TEXT PRIMARY KEY,  -- whose memory this is, 32 hex digits
        schema BLOB NOT NULL,    -- digest of its genome schema
        life INTEGER NOT NULL,   -- number of its present start
        serial INTEGER NOT NULL, -- number of the last transaction
        newest INTEGER NOT NULL, -- serial of the newest snapshot, 0 if there is none
        older INTEGER NOT NULL,  -- and of the one before it
        total BLOB NOT NULL,     -- XOR over the digests of all encounters and events
        layout BLOB NOT NULL,    -- digest of these table definitions
        digest BLOB NOT NULL
    ) WITHOUT ROWID;
    CREATE TABLE encounters (
        seq INTEGER PRIMARY KEY,   -- 1, 2, 3, ... without gaps
        initiator TEXT NOT NULL,   -- robot ids are 32 hex digits
        responder TEXT NOT NULL,
        life INTEGER NOT NULL,     -- of the initiator, at its proposal
        count INTEGER NOT NULL,    -- of its proposals in that life
        role TEXT NOT NULL,        -- of this robot: initiator or responder
        state TEXT NOT NULL,       -- decided, prepared, mated or aborted
        nonce INTEGER NOT NULL,
        tick INTEGER NOT NULL,     -- of the contact
        own_agent TEXT NOT NULL,
        own_genes BLOB NOT NULL,   -- genes are little-endian float64
        partner_agent TEXT,
        partner_genes BLOB,
        proof BLOB NOT NULL,       -- the partner's signed letter
        orphaned INTEGER NOT NULL, -- 1 if the partner did not come back in time
        energy REAL,               -- from here on NULL, unless it is decided about offspring
        conceived INTEGER,
        too_late INTEGER,
        child BLOB,                -- genes of the offspring
        step INTEGER,              -- of this robot
        stream BLOB,               -- its randomness after the decision
        serial INTEGER,            -- of the transaction that decided
        digest BLOB NOT NULL,
        UNIQUE (initiator, responder, life, count)
    );
    CREATE TABLE events (
        seq INTEGER PRIMARY KEY, -- 1, 2, 3, ... without gaps
        tick INTEGER NOT NULL,
        kind TEXT NOT NULL,      -- a class of crcolony.colony.history
        body BLOB NOT NULL,      -- MessagePack
        digest BLOB NOT NULL
    );
    CREATE TABLE snapshots (
        serial INTEGER PRIMARY KEY, -- it holds all that was decided up to this transaction
        tick INTEGER NOT NULL,
        taken INTEGER NOT NULL,     -- Unix time, s
        events INTEGER NOT NULL,    -- how many events there were
        robot BLOB NOT NULL,        -- a checkpoint: read it with numpy.load
        digest BLOB NOT NULL
    );
    """,
)
"""How a memory came to its present form; `user_version` counts how many of these it has been through."""

_DIGEST_BYTES = 16
_encode = msgspec.msgpack.Encoder().encode


class StoreError(Refusal):
    """A memory cannot be used: the message names the file and the reason."""


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


def digest_of(table: str, columns: Mapping[str, Any]) -> bytes:
    """Return the digest of a row: over all its columns but the digest, whatever their order."""
    content = sorted((name, value) for name, value in columns.items() if name != "digest")
    return hashlib.blake2b(_encode((table, content)), digest_size=_DIGEST_BYTES).digest()


def put(database: sqlite3.Connection, table: str, columns: Mapping[str, Any]) -> bytes:
    """Write a row, in place of one with the same key; return its digest."""
    return _insert(database, "INSERT OR REPLACE", table, columns)


def insert(database: sqlite3.Connection, table: str, columns: Mapping[str, Any]) -> bytes:
    """Write a new row; return its digest. Raises sqlite3.IntegrityError if there is one of the same key."""
    return _insert(database, "INSERT", table, columns)


def _insert(
    database: sqlite3.Connection, how: str, table: str, columns: Mapping[str, Any]
) -> bytes:
    row = {**columns, "digest": digest_of(table, columns)}
    marks = ", ".join("?" * len(row))
    database.execute(f"{how} INTO {table} ({', '.join(row)}) VALUES ({marks})", tuple(row.values()))
    digest: bytes = row["digest"]
    return digest


def update(
    database: sqlite3.Connection, table: str, before: Mapping[str, Any], columns: Mapping[str, Any]
) -> bytes:
    """Change a row, found by its `seq`, where it differs from what it was; return its digest.

    What does not change is not written: SQLite then leaves the pages of the indices alone.
    """
    changed = {name: value for name, value in columns.items() if value != before[name]}
    changed["digest"] = digest_of(table, columns)
    sets = ", ".join(f"{name} = ?" for name in changed)
    database.execute(
        f"UPDATE {table} SET {sets} WHERE seq = ?", (*changed.values(), columns["seq"])
    )
    digest: bytes = changed["digest"]
    return digest


def select(
    database: sqlite3.Connection, query: str, *values: int | str | bytes
) -> Iterator[dict[str, Any]]:
    """Yield rows as dicts by column."""
    cursor = database.execute(query, values)
    names = [column[0] for column in cursor.description]
    for row in cursor:
        yield dict(zip(names, row, strict=True))


def find(
    database: sqlite3.Connection, query: str, *values: int | str | bytes
) -> dict[str, Any] | None:
    """Return the one row there is, if there is one."""
    rows = list(select(database, query, *values))
    return rows[0] if rows else None


@contextlib.contextmanager
def named_errors(path: Path) -> Iterator[None]:
    """Turn whatever SQLite raises about a file into a StoreError."""
    try:
        yield
    except sqlite3.Error as error:
        raise StoreError(f"{path}: {_reason(error)}") from None
    except UnicodeDecodeError:  # of an error's text that quotes the damage
        raise StoreError(f"{path}: corrupt") from None


def primary_code(error: Exception) -> int:
    """Return which kind of error SQLite met, or -1 if the error is not SQLite's own."""
    return getattr(error, "sqlite_errorcode", -1) & 0xFF


def _reason(error: sqlite3.Error) -> str:
    match primary_code(error):
        case sqlite3.SQLITE_NOTADB:
            return "not a crcolony memory"
        case sqlite3.SQLITE_BUSY:
            return "in use by another process"
        case sqlite3.SQLITE_FULL:
            return "cannot be written: the disk is full"
        case sqlite3.SQLITE_READONLY | sqlite3.SQLITE_PERM | sqlite3.SQLITE_CANTOPEN:
            return f"cannot be opened or written: {error}"
        case sqlite3.SQLITE_IOERR:
            return f"cannot be read or written: {error}"
        case _:
            return f"corrupt: {str(error).splitlines()[0]}"


def refuse_emptied(path: Path) -> None:
    """Raise StoreError for a file that lost all its pages but not its log; opening it, SQLite would delete that too."""
    log = path.with_name(path.name + "-wal")
    is_empty = not path.exists() or path.stat().st_size == 0
    if is_empty and log.exists() and log.stat().st_size > 0:
        raise StoreError(f"{path}: corrupt: it is empty, and its log is not")


def recognise(database: sqlite3.Connection, path: Path) -> bool:
    """Tell whether a file is a memory (True) or has nothing in it (False); raises StoreError for anything else."""
    application = int(database.execute("PRAGMA application_id").fetchone()[0])
    if application == APPLICATION_ID:
        return True
    if application or database.execute("SELECT count(*) FROM sqlite_schema").fetchone()[0]:
        raise StoreError(f"{path}: not a crcolony memory")
    return False


def create(database: sqlite3.Connection, robot: str, schema: bytes) -> None:
    """Make the tables of a new memory, in one transaction."""
    database.executescript("BEGIN IMMEDIATE;" + "".join(MIGRATIONS))
    put(database, "memory", vars(Head(robot, schema, layout=_layout(database))))
    database.execute(f"PRAGMA application_id = {APPLICATION_ID}")
    database.execute(f"PRAGMA user_version = {len(MIGRATIONS)}")
    database.execute("COMMIT")


def migrate(database: sqlite3.Connection, path: Path) -> None:
    """Bring a sound memory of an older version to the present one, in one transaction; refuse a newer one."""
    version = int(database.execute("PRAGMA user_version").fetchone()[0])
    if version > len(MIGRATIONS):
        raise StoreError(
            f"{path}: written by a newer crcolony (version {version}); update this one"
        )
    if version == len(MIGRATIONS):
        return
    if version < 1:
        raise StoreError(f"{path}: corrupt: it has no version")
    checked = check(database, path)
    database.executescript("BEGIN IMMEDIATE;" + "".join(MIGRATIONS[version:]))
    _seal_again(database, checked)
    database.execute(f"PRAGMA user_version = {len(MIGRATIONS)}")
    database.execute("COMMIT")


def _seal_again(database: sqlite3.Connection, checked: Checked) -> None:
    """Give every sound row a digest over its present columns."""
    head = checked.head
    head.total, head.layout = bytes(_DIGEST_BYTES), _layout(database)
    for table in ("encounters", "events"):
        for row in list(select(database, f"SELECT * FROM {table}")):
            head.include(put(database, table, row))
    for row in list(select(database, "SELECT * FROM snapshots")):
        if row["serial"] not in checked.damaged:
            put(database, "snapshots", row)
    put(database, "memory", vars(head))


def check(database: sqlite3.Connection, path: Path) -> Checked:
    """Look at every page and row; raises StoreError for any damage that is not to a snapshot."""
    for (finding,) in database.execute("PRAGMA integrity_check(1)"):
        if finding != "ok":
            raise StoreError(f"{path}: corrupt: {finding.splitlines()[0]}")
    rows = list(select(database, "SELECT * FROM memory"))
    if len(rows) != 1 or rows[0].pop("digest") != digest_of("memory", rows[0]):
        raise StoreError(f"{path}: corrupt: the row of table memory is damaged")
    head = Head(**rows[0])
    if head.layout != _layout(database):
        raise StoreError(f"{path}: corrupt: its tables are not as they were")
    found = Head(head.robot, head.schema)
    for table in ("encounters", "events"):
        for seq, row in enumerate(select(database, f"SELECT * FROM {table} ORDER BY seq"), 1):
            if row["seq"] != seq or row["digest"] != digest_of(table, row):
                raise StoreError(f"{path}: corrupt: row {seq} of table {table} is damaged or lost")
            found.include(row["digest"])
    if found.total != head.total:
        raise StoreError(f"{path}: corrupt: rows are missing, or of different moments")
    return Checked(head, _damaged_snapshots(database, head, path))


def _damaged_snapshots(database: sqlite3.Connection, head: Head, path: Path) -> frozenset[int]:
    serials, damaged = set(), set()
    for row in select(database, "SELECT * FROM snapshots"):
        serials.add(row["serial"])
        if row["digest"] != digest_of("snapshots", row):
            damaged.add(row["serial"])
    if serials != {head.newest, head.older} - {0}:
        raise StoreError(f"{path}: corrupt: a snapshot is missing, or of another moment")
    if serials and serials == damaged:
        raise StoreError(f"{path}: corrupt: no snapshot is undamaged")
    return frozenset(damaged)


def _layout(database: sqlite3.Connection) -> bytes:
    """Return a digest of the tables' definitions; what an analyst adds (an index, a view) does not matter."""
    query = "SELECT name, sql FROM sqlite_schema WHERE type = 'table' AND name IN (?, ?, ?, ?)"
    tables = database.execute(query, ("memory", "encounters", "events", "snapshots")).fetchall()
    return digest_of("sqlite_schema", dict(tables))
