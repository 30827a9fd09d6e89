"""The SQLite schema of a telemetry file, its versions, and how a file of an older version is read and upgraded.

Version 1 had other names: table `heard`, column `data`, kinds `alive` and `gone`.
"""

import sqlite3
from pathlib import Path
from typing import get_args

from crcolony.errors import CrcolonyError
from crcolony.telemetry.samples import RawSample, SampleKind

KINDS: tuple[SampleKind, ...] = get_args(SampleKind)
_VERSION = "2"
_APPLICATION = "crcolony telemetry"
_INDEX = "CREATE INDEX tokens ON samples (key) WHERE kind IN ('online', 'offline');"
_CREATE = f"""
    BEGIN;
    CREATE TABLE meta (name TEXT PRIMARY KEY, value TEXT NOT NULL);
    CREATE TABLE samples (
        unix_ms INTEGER NOT NULL, kind TEXT NOT NULL, key TEXT NOT NULL, payload BLOB NOT NULL
    );
    {_INDEX}
    INSERT INTO meta VALUES ('application', '{_APPLICATION}'), ('version', '{_VERSION}');
    COMMIT;
"""
_UPGRADE_FROM_1 = f"""
    BEGIN IMMEDIATE;
    DROP INDEX tokens;
    ALTER TABLE heard RENAME TO samples;
    ALTER TABLE samples RENAME COLUMN data TO payload;
    UPDATE samples SET kind = CASE kind WHEN 'alive' THEN 'online' ELSE 'offline' END
        WHERE kind IN ('alive', 'gone');
    {_INDEX}
    UPDATE meta SET value = '{_VERSION}' WHERE name = 'version';
    COMMIT;
"""
_KINDS_OF_1: dict[SampleKind, str] = {"online": "alive", "offline": "gone"}
_FOREIGN = (sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_ERROR)
"""SQLite's error codes for other files, and for databases without these tables."""

_INSERT = "INSERT INTO samples (unix_ms, kind, key, payload) VALUES (?, ?, ?, ?)"
_ONLINE = """
    SELECT key FROM (
        SELECT key, kind, max(rowid) AS last FROM samples INDEXED BY tokens
        WHERE kind IN ('online', 'offline') GROUP BY key
    ) WHERE kind = 'online' ORDER BY last
"""


class TelemetryError(CrcolonyError):
    """A telemetry file cannot be read or written: the message names the file and the reason."""


def read_version(database: sqlite3.Connection, path: Path) -> str | None:
    """Return the version of a telemetry file, 1 or 2, or None if the file is empty; raises TelemetryError otherwise."""
    try:
        if not database.execute("SELECT 1 FROM sqlite_master LIMIT 1").fetchone():
            return None
        meta = dict(database.execute("SELECT name, value FROM meta"))
    except sqlite3.DatabaseError as error:
        if error.sqlite_errorcode not in _FOREIGN:
            raise
        raise TelemetryError(f"{path}: not a telemetry file: {error}") from None
    if meta.get("application") != _APPLICATION:
        raise TelemetryError(f"{path}: not a telemetry file: it belongs to another application")
    if meta.get("version") not in ("1", _VERSION):
        raise TelemetryError(f"{path}: a telemetry file of another version of crcolony")
    return str(meta["version"])


def prepare_for_writing(database: sqlite3.Connection, path: Path) -> None:
    """Create the tables in an empty file, or upgrade a file of version 1; raises TelemetryError, sqlite3.Error."""
    version = read_version(database, path)
    if version is None:
        database.execute("PRAGMA journal_mode=WAL")
        database.executescript(_CREATE)
    elif version == "1":
        database.executescript(_UPGRADE_FROM_1)


def insert_samples(database: sqlite3.Connection, samples: list[RawSample]) -> None:
    """Append samples; the caller commits."""
    rows = [(sample.unix_ms, sample.kind, sample.key, sample.payload) for sample in samples]
    database.executemany(_INSERT, rows)


def insert_offline_samples(database: sqlite3.Connection) -> None:
    """Append an offline sample for every token that was online when the recording ended; the caller commits."""
    keys = [key for (key,) in database.execute(_ONLINE)]
    if keys:
        last = "SELECT unix_ms FROM samples ORDER BY rowid DESC LIMIT 1"
        (unix_ms,) = database.execute(last).fetchone()
        insert_samples(database, [RawSample("offline", key, b"", unix_ms) for key in keys])


def read_last_scene_unix_ms(database: sqlite3.Connection, path: Path) -> int:
    """Return when the last scene in a file arrived, 0 if there is none; raises TelemetryError, sqlite3.Error."""
    table = _table(read_version(database, path))
    (unix_ms,) = database.execute(
        f"SELECT max(unix_ms) FROM {table} WHERE kind = 'scene'"
    ).fetchone()
    return unix_ms if isinstance(unix_ms, int) else 0


def _table(version: str | None) -> str:
    return "heard" if version == "1" else "samples"


class SampleQuery:
    """The SQL that reads samples of some kinds from a file of some version, in pages."""

    def __init__(self, version: str, kinds: tuple[SampleKind, ...], page_rows: int) -> None:
        names = _KINDS_OF_1 if version == "1" else {}
        self._kind_of: dict[object, SampleKind] = {names.get(kind, kind): kind for kind in kinds}
        """By the name that the file has for it"""
        self._page_rows = page_rows
        marks = ", ".join("?" * len(kinds))
        table = _table(version)
        self._sql = f"SELECT rowid, * FROM {table} WHERE rowid > ? AND kind IN ({marks}) ORDER BY rowid LIMIT ?"

    def fetch(self, database: sqlite3.Connection, after: int) -> list[tuple[int, RawSample | None]]:
        """Return the next page after a row: row numbers and samples, None for what is no sample."""
        page = database.execute(self._sql, (after, *self._kind_of, self._page_rows))
        return [(number, self._sample(*row)) for number, *row in page]

    def _sample(
        self, unix_ms: object, kind: object, key: object, payload: object
    ) -> RawSample | None:
        known = self._kind_of.get(kind)
        if (
            known
            and isinstance(unix_ms, int)
            and isinstance(key, str)
            and isinstance(payload, bytes)
        ):
            return RawSample(known, key, payload, unix_ms)
        return None
