"""The file of a robot's memory: its tables, how an older file becomes a present one, and how damage to it is found.

    StorageError                a memory cannot be used: the message names the file and the reason

SQLite checksums its log (the WAL) but not the main file. So every row carries a digest over its columns, and the one
row of `memory` a digest over all of those: a flipped bit, a lost row, and pages of two different moments are all found.
A snapshot is the exception: if the newest is damaged there is an older one, so its damage is told, not refused.
"""

import sqlite3
from pathlib import Path

from crcolony.storage.integrity import Checked, Head, _layout, check
from crcolony.storage.sql import _DIGEST_BYTES, StorageError, put, select

APPLICATION_ID = 0x43524D59  # "CRMY", what `file` shows of a robot file

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
        count INTEGER NOT NULL,    -- of its proposals in that incarnation
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
        kind TEXT NOT NULL,      -- a class of crcolony.evolution.history
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


def refuse_emptied(path: Path) -> None:
    """Raise StorageError for a file that lost all its pages but not its log; opening it, SQLite would delete that too."""
    log = path.with_name(path.name + "-wal")
    is_empty = not path.exists() or path.stat().st_size == 0
    if is_empty and log.exists() and log.stat().st_size > 0:
        raise StorageError(f"{path}: corrupt: it is empty, and its log is not")


def recognise(database: sqlite3.Connection, path: Path) -> bool:
    """Tell whether a file is a memory (True) or has nothing in it (False); raises StorageError for anything else."""
    application = int(database.execute("PRAGMA application_id").fetchone()[0])
    if application == APPLICATION_ID:
        return True
    if application or database.execute("SELECT count(*) FROM sqlite_schema").fetchone()[0]:
        raise StorageError(f"{path}: not a crcolony robot file")
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
        raise StorageError(
            f"{path}: written by a newer crcolony (version {version}); update this one"
        )
    if version == len(MIGRATIONS):
        return
    if version < 1:
        raise StorageError(f"{path}: corrupt: it has no version")
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
