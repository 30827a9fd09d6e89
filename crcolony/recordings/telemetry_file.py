"""What was heard of colonies, as it came, in one SQLite file: to be drawn again, and to be exported.

A process that is killed loses what it heard since its last commit; the file can be read at any time, also meanwhile.
When the disk is full nothing is recorded any more, and the file stays readable.
"""

import sqlite3
from collections.abc import Collection, Iterator
from contextlib import closing
from pathlib import Path
from typing import get_args
from urllib.parse import quote

from crcolony.errors import CrcolonyError
from crcolony.recordings.disk_space import check_room
from crcolony.recordings.downsampling import Downsampler
from crcolony.storage.sql import close_as_one_file
from crcolony.telemetry.colony_monitor import SampleKind, TelemetrySample

TELEMETRY_FILE = "telemetry.sqlite"
"""Of the recording in a folder"""
SCENE_BYTES_PER_S = 100_000
"""So much of the scenes is kept: all ten a second of a few robots, and one or so of a thousand"""
_MAX_WAITING = 64 * 2**20
"""Bytes between two commits; of more the newest is not recorded, and counted"""
_PAGE = 256
"""Rows that are read at a time, so that a slow reader is in no writer's way"""
_BESIDE_DATA = 100
"""Bytes that a row takes beside its data, more or less"""

KINDS: tuple[SampleKind, ...] = get_args(SampleKind)
"""All there is to hear"""
_META = {"application": "crcolony telemetry", "version": "1"}
_TABLES = """
    CREATE TABLE meta (name TEXT PRIMARY KEY, value TEXT NOT NULL);
    CREATE TABLE heard (unix_ms INTEGER NOT NULL, kind TEXT NOT NULL, key TEXT NOT NULL, data BLOB NOT NULL);
    CREATE INDEX tokens ON heard (key) WHERE kind IN ('alive', 'gone');
"""
_FOREIGN = (sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_ERROR)
"""What SQLite says of other files, and of databases without these tables"""
_ALIVE = """
    SELECT key FROM (
        SELECT key, kind, max(rowid) AS last FROM heard INDEXED BY tokens
        WHERE kind IN ('alive', 'gone') GROUP BY key
    ) WHERE kind = 'alive' ORDER BY last
"""


class TelemetryError(CrcolonyError):
    """A telemetry file cannot be read or written: the message names the file and the reason."""


class TelemetryFile:
    """Takes what is heard, for one thread; `commit` is to be called once a second or so."""

    def __init__(self, path: Path, database: sqlite3.Connection) -> None:
        self.path = path
        self.dropped = 0
        """What was not recorded, since too much was heard between two commits"""
        self._database: sqlite3.Connection | None = database
        self._waiting: list[TelemetrySample] = []
        self._bytes = 0
        self._thinning = Downsampler(SCENE_BYTES_PER_S)

    @classmethod
    def open(cls, path: Path) -> "TelemetryFile":
        """Make a file, or go on with one; raises TelemetryError if it is another's or cannot be written.

        Whoever was on the network when the recording ended is gone: if not, they are heard of again.
        """
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            database = sqlite3.connect(path)
        except (OSError, sqlite3.Error) as error:
            raise _cannot_be_written(path, error) from None
        try:
            if not _recognise(database, path):
                _make(database)
            database.execute("PRAGMA synchronous=NORMAL")
            with database:
                _end_tokens(database)
        except (sqlite3.Error, TelemetryError) as error:
            database.close()
            if isinstance(error, TelemetryError):
                raise
            raise _cannot_be_written(path, error) from None
        return cls(path, database)

    def add(self, sample: TelemetrySample) -> None:
        """Take what was heard; it is on the disk after the next commit. Of too many scenes some are left out."""
        if self._database is None:
            return
        size = len(sample.data) + _BESIDE_DATA
        if sample.kind == "scene" and not self._thinning.should_keep(size, sample.unix_ms):
            return
        if self._bytes + size > _MAX_WAITING:
            self.dropped += 1
            return
        self._waiting.append(sample)
        self._bytes += size

    def commit(self) -> str | None:
        """Put what was heard on the disk; return why nothing is recorded any more, once, if that is so."""
        if self._database is None:
            return None
        waiting, self._waiting, self._bytes = self._waiting, [], 0
        try:
            check_room(self.path.parent)
            with self._database as database:
                database.executemany("INSERT INTO heard VALUES (?, ?, ?, ?)", map(_row, waiting))
        except (OSError, sqlite3.Error) as error:
            self._end()
            return f"{self.path}: not recorded any more: {_reason(error)}"
        return None

    def close(self) -> str | None:
        """Commit, and let the file go, as one that can be copied and read anywhere."""
        trouble = self.commit()
        self._end()
        return trouble

    def _end(self) -> None:
        if self._database is not None:
            close_as_one_file(self._database)
            self._database = None


def read_samples(path: Path, kinds: Collection[SampleKind] = KINDS) -> Iterator[TelemetrySample]:
    """Yield what was heard, in order, also what is recorded meanwhile; of some kinds or all.

    Raises TelemetryError naming the file.
    """
    if not path.is_file():
        raise TelemetryError(f"{path}: no telemetry: there is no such file")
    wanted = ", ".join("?" * len(kinds))
    page = (
        f"SELECT rowid, * FROM heard WHERE rowid > ? AND kind IN ({wanted}) ORDER BY rowid LIMIT ?"
    )
    try:
        with closing(
            sqlite3.connect(f"file:{quote(str(path.absolute()))}?mode=ro", uri=True)
        ) as it:
            if not _recognise(it, path):
                raise TelemetryError(f"{path}: not a telemetry file: it is empty")
            last = 0
            while rows := it.execute(page, (last, *kinds, _PAGE)).fetchall():
                last = rows[-1][0]
                for row in rows:
                    yield _heard(row, path)
    except sqlite3.Error as error:
        raise TelemetryError(f"{path}: cannot be read: {error}") from None


def _make(database: sqlite3.Connection) -> None:
    database.execute("PRAGMA journal_mode=WAL")
    values = ", ".join(f"('{name}', '{value}')" for name, value in _META.items())
    database.executescript(f"BEGIN; {_TABLES} INSERT INTO meta VALUES {values}; COMMIT;")


def _recognise(database: sqlite3.Connection, path: Path) -> bool:
    """Tell whether this is a telemetry file of this version, or an empty file; raises TelemetryError if neither."""
    try:
        if not database.execute("SELECT 1 FROM sqlite_master LIMIT 1").fetchone():
            return False
        meta = dict(database.execute("SELECT name, value FROM meta"))
    except sqlite3.DatabaseError as error:
        if error.sqlite_errorcode not in _FOREIGN:
            raise
        raise TelemetryError(f"{path}: not a telemetry file: {error}") from None
    if meta.get("application") != _META["application"]:
        raise TelemetryError(f"{path}: not a telemetry file: it is another application's")
    if meta.get("version") != _META["version"]:
        raise TelemetryError(f"{path}: a telemetry file of another version of crcolony")
    return True


def _end_tokens(database: sqlite3.Connection) -> None:
    """Let all be gone whose tokens were there when the recording ended."""
    alive = database.execute(_ALIVE).fetchall()
    if alive:
        (unix_ms,) = database.execute(
            "SELECT unix_ms FROM heard ORDER BY rowid DESC LIMIT 1"
        ).fetchone()
        gone = [_row(TelemetrySample("gone", key, b"", unix_ms)) for (key,) in alive]
        database.executemany("INSERT INTO heard VALUES (?, ?, ?, ?)", gone)


def _row(sample: TelemetrySample) -> tuple[int, str, str, bytes]:
    return sample.unix_ms, sample.kind, sample.key, sample.data


def _heard(row: tuple[int, int, SampleKind, str, bytes], path: Path) -> TelemetrySample:
    number, unix_ms, kind, key, data = row
    if kind not in KINDS or not isinstance(key, str) or not isinstance(data, bytes):
        raise TelemetryError(f"{path}: damaged: row {number} is nothing that was heard")
    return TelemetrySample(kind, key, data, unix_ms)


def _cannot_be_written(path: Path, error: OSError | sqlite3.Error) -> TelemetryError:
    return TelemetryError(f"{path}: cannot be written: {_reason(error)}")


def _reason(error: OSError | sqlite3.Error) -> str:
    return (error.strerror if isinstance(error, OSError) else None) or str(error)
