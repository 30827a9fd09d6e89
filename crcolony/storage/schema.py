"""The tables of a robot's file, and how a file of an older version becomes one of the present version."""

import sqlite3
from pathlib import Path

from crcolony.storage.files import log_of
from crcolony.storage.integrity import (
    NAMES,
    NAMES_OF_VERSION_1,
    Head,
    IntegrityReport,
    Names,
    check_integrity,
    layout_digest,
)
from crcolony.storage.sql import DIGEST_BYTES, StorageError, insert_or_replace, select

APPLICATION_ID = 0x43524D59
""""CRMY" in ASCII, which the command `file` shows of a robot's file."""

MIGRATIONS = (
    """
    CREATE TABLE memory (
        robot TEXT PRIMARY KEY,  -- whose file this is, 32 hex digits
        schema BLOB NOT NULL,    -- digest of its genotype schema
        life INTEGER NOT NULL,   -- ordinal of its present start
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
        count INTEGER NOT NULL,    -- of its proposals since that start
        role TEXT NOT NULL,        -- of this robot: initiator or responder
        state TEXT NOT NULL,       -- decided, prepared, mated or aborted
        nonce INTEGER NOT NULL,
        tick INTEGER NOT NULL,     -- of the contact
        own_agent TEXT NOT NULL,
        own_genes BLOB NOT NULL,   -- genes are little-endian float64
        partner_agent TEXT,
        partner_genes BLOB,
        proof BLOB NOT NULL,       -- the partner's signed envelope
        orphaned INTEGER NOT NULL, -- 1 if the partner did not come back in time
        energy REAL,               -- from here on NULL, unless it is decided about offspring
        conceived INTEGER,
        too_late INTEGER,
        child BLOB,                -- genes of the offspring
        step INTEGER,              -- of this robot
        stream BLOB,               -- state of its random generator after the decision
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
    """
    ALTER TABLE memory RENAME TO head;
    ALTER TABLE head RENAME COLUMN life TO incarnation;
    ALTER TABLE encounters RENAME COLUMN life TO incarnation;
    """,
)
"""One script for each version; `PRAGMA user_version` is the number of those that a file has been through.

Columns and tables are renamed in place: what a user added (an index, a view) stays, and follows the new names.
"""


def check_not_truncated(path: Path) -> None:
    """Raise StorageError for an empty file that has a log; opening it, SQLite would delete the log too."""
    log = log_of(path)
    is_empty = not path.exists() or path.stat().st_size == 0
    if is_empty and log.exists() and log.stat().st_size > 0:
        raise StorageError(f"{path}: corrupt: it is empty, and its log is not")


def is_robot_file(database: sqlite3.Connection, path: Path) -> bool:
    """Return True for a robot's file and False for an empty database; raises StorageError for anything else."""
    application = int(database.execute("PRAGMA application_id").fetchone()[0])
    if application == APPLICATION_ID:
        return True
    if application or database.execute("SELECT count(*) FROM sqlite_schema").fetchone()[0]:
        raise StorageError(f"{path}: not a crcolony robot file")
    return False


def create_tables(database: sqlite3.Connection, robot: str, schema: bytes) -> None:
    """Create the tables of a new robot's file in one transaction."""
    database.executescript("BEGIN IMMEDIATE;" + "".join(MIGRATIONS))
    head = Head(robot, schema, layout=layout_digest(database))
    insert_or_replace(database, NAMES.head, vars(head))
    database.execute(f"PRAGMA application_id = {APPLICATION_ID}")
    database.execute(f"PRAGMA user_version = {len(MIGRATIONS)}")
    database.execute("COMMIT")


def names_in(database: sqlite3.Connection, path: Path) -> Names:
    """Return the names of the version that wrote a file; raises StorageError if that version is newer, or unknown."""
    version = _version_of(database)
    if version > len(MIGRATIONS):
        raise StorageError(
            f"{path}: written by a newer crcolony (version {version}); update this one"
        )
    if version < 1:
        raise StorageError(f"{path}: corrupt: it has no version")
    return NAMES_OF_VERSION_1 if version == 1 else NAMES


def migrate(database: sqlite3.Connection, path: Path) -> None:
    """Bring a file of an older version to the present one, in one transaction.

    Raises StorageError for a file that is damaged, or was written by a newer version.
    """
    names, version = names_in(database, path), _version_of(database)
    if version == len(MIGRATIONS):
        return
    report = check_integrity(database, path, names)
    database.executescript("BEGIN IMMEDIATE;" + "".join(MIGRATIONS[version:]))
    _rewrite_digests(database, report)
    database.execute(f"PRAGMA user_version = {len(MIGRATIONS)}")
    database.execute("COMMIT")


def _version_of(database: sqlite3.Connection) -> int:
    return int(database.execute("PRAGMA user_version").fetchone()[0])


def _rewrite_digests(database: sqlite3.Connection, report: IntegrityReport) -> None:
    """Give every undamaged row a digest under the present names and columns."""
    head = report.head
    head.total, head.layout = bytes(DIGEST_BYTES), layout_digest(database)
    for table in ("encounters", "events"):
        for row in list(select(database, f"SELECT * FROM {table}")):
            head.toggle(insert_or_replace(database, table, row))
    for row in list(select(database, "SELECT * FROM snapshots")):
        if row["serial"] not in report.damaged_snapshots:
            insert_or_replace(database, "snapshots", row)
    insert_or_replace(database, NAMES.head, vars(head))
