"""A recording of telemetry: raw samples as they arrived, in one SQLite file, to be replayed and exported.

A process that is killed loses the samples since its last commit; the file can be read at any time, also meanwhile.
When the disk is full the recording ends, and the file stays readable.
"""

import os
import sqlite3
from collections.abc import Collection, Iterator
from contextlib import closing
from pathlib import Path
from urllib.parse import quote

from crcolony.recordings.disk_space import check_room
from crcolony.recordings.downsampling import Downsampler
from crcolony.recordings.retention import Retention
from crcolony.recordings.telemetry_schema import (
    KINDS,
    SampleQuery,
    TelemetryError,
    insert_offline_samples,
    insert_samples,
    prepare_for_writing,
    read_last_scene_unix_ms,
    read_version,
)
from crcolony.storage.files import FileInUseError, lock_file, lock_of
from crcolony.storage.sql import StorageError, close_as_one_file
from crcolony.telemetry.samples import RawSample, SampleKind
from crcolony.transport.bounded_queue import BoundedQueue

TELEMETRY_FILE = "telemetry.sqlite"
"""Name of the recording in a folder."""
SCENE_BYTES_PER_S = 100_000
"""Of scenes so much is kept: ten a second of a few robots, about one a second of a thousand robots."""
_MAX_BYTES = 64 * 2**20
"""Samples between two commits; further ones are dropped and counted."""
_ROW_BYTES = 100
"""Size of a row without its payload, about."""
_PAGE_ROWS = 256
"""Rows that are read at a time, so that a slow reader does not block the writer."""


class RecordingInUseError(TelemetryError):
    """Another process records into a file."""


class TelemetryFile:
    """Records samples, for one thread; `commit` is to be called about once a second."""

    def __init__(
        self, path: Path, database: sqlite3.Connection, lock: int, retention: Retention | None
    ) -> None:
        self.path, self._lock, self._retention = path, lock, retention
        self._database: sqlite3.Connection | None = database
        self._queue = BoundedQueue[RawSample](_MAX_BYTES // _ROW_BYTES, _MAX_BYTES)
        self._downsampler = Downsampler(SCENE_BYTES_PER_S)

    @property
    def dropped(self) -> int:
        """How many samples were not recorded because too many arrived between two commits."""
        return self._queue.dropped

    @classmethod
    def open(cls, path: Path, retention: Retention | None = None) -> "TelemetryFile":
        """Create a file, or continue one; raises TelemetryError if it is no telemetry file or cannot be written.

        RecordingInUseError if another process records into it.
        Without `retention` it keeps everything.

        Robots and arenas that were online when an earlier recording ended are recorded as offline first.
        """
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            lock = lock_file(path)
        except OSError as error:
            raise _cannot_be_written(path, error) from None
        except FileInUseError as error:
            raise RecordingInUseError(str(error)) from None
        except StorageError as error:
            raise TelemetryError(str(error)) from None
        try:
            return cls(path, cls._connect(path), lock, retention)
        except TelemetryError:
            os.close(lock)
            raise

    @staticmethod
    def _connect(path: Path) -> sqlite3.Connection:
        """Return the database of a file, whose last recording has ended; raises TelemetryError."""
        try:
            database = sqlite3.connect(path)
        except sqlite3.Error as error:
            raise _cannot_be_written(path, error) from None
        try:
            prepare_for_writing(database, path)
            database.execute("PRAGMA synchronous=NORMAL")
            with database:
                insert_offline_samples(database)
        except (sqlite3.Error, TelemetryError) as error:
            database.close()
            if isinstance(error, TelemetryError):
                raise
            raise _cannot_be_written(path, error) from None
        return database

    def add(self, sample: RawSample) -> None:
        """Add a sample; it is on the disk after the next commit. Scenes are downsampled."""
        if self._database is None:
            return
        size_bytes = len(sample.payload) + _ROW_BYTES
        if sample.kind != "scene" or self._downsampler.should_keep(size_bytes, sample.unix_ms):
            self._queue.put(sample, size_bytes)

    def commit(self) -> str | None:
        """Write the samples to the disk; return the reason, once, if the recording has ended."""
        if self._database is None:
            return None
        samples = self._queue.get_all()
        try:
            check_room(self.path.parent)
            with self._database as database:
                insert_samples(database, samples)
                if self._retention is not None and samples:
                    self._retention.delete_old(database, samples[-1].unix_ms)
        except (OSError, sqlite3.Error) as error:
            self._end()
            return f"{self.path}: not recorded any more: {_format_error(error)}"
        return None

    def close(self) -> str | None:
        """Commit and close the file, as one file that can be copied; return what `commit` does."""
        trouble = self.commit()
        self._end()
        return trouble

    def _end(self) -> None:
        if self._database is not None:
            close_as_one_file(self._database)
            self._database = None
            lock_of(self.path).unlink(missing_ok=True)
            os.close(self._lock)


def read_samples(path: Path, kinds: Collection[SampleKind] = KINDS) -> Iterator[RawSample]:
    """Yield the samples of some kinds in the order of their arrival, also those that are recorded meanwhile.

    Raises TelemetryError naming the file.
    """
    if not path.is_file():
        raise TelemetryError(f"{path}: no telemetry: there is no such file")
    try:
        with closing(_open_for_reading(path)) as database:
            version = read_version(database, path)
            if version is None:
                raise TelemetryError(f"{path}: not a telemetry file: it is empty")
            query, last = SampleQuery(version, tuple(kinds), _PAGE_ROWS), 0
            while page := query.fetch(database, last):
                for last, sample in page:
                    if sample is None:
                        raise TelemetryError(f"{path}: damaged: row {last} is no sample")
                    yield sample
    except sqlite3.Error as error:
        raise TelemetryError(f"{path}: cannot be read: {error}") from None


def last_scene_unix_ms(path: Path) -> int:
    """Return when the last scene of a recording arrived, 0 if it has none; raises TelemetryError."""
    try:
        with closing(_open_for_reading(path)) as database:
            return read_last_scene_unix_ms(database, path)
    except sqlite3.Error as error:
        raise TelemetryError(f"{path}: cannot be read: {error}") from None


def _open_for_reading(path: Path) -> sqlite3.Connection:
    return sqlite3.connect(f"file:{quote(str(path.absolute()))}?mode=ro", uri=True)


def _cannot_be_written(path: Path, error: OSError | sqlite3.Error) -> TelemetryError:
    return TelemetryError(f"{path}: cannot be written: {_format_error(error)}")


def _format_error(error: OSError | sqlite3.Error) -> str:
    return (error.strerror if isinstance(error, OSError) else None) or str(error)
