"""A robot's file, open for writing: encounters and decisions, the robot's history, and snapshots of the whole robot.

    StorageError         at opening and reading: the file cannot be used
    StorageFullError     a transaction is certainly not on the disk: there is no room, or another process locks the file
    FatalStorageError    it is unknown what is on the disk: the process must stop and start again from there

When a method returns, its transaction is on the disk (with `durable`). A transaction is there whole or not at all.
"""

import contextlib
import io
import os
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn

from crcolony.errors import CrcolonyError, FatalStorageError
from crcolony.evolution.history import Event
from crcolony.protocol.encounters import EncounterRecord
from crcolony.protocol.identity import RobotId
from crcolony.storage.checkpoint import CheckpointError, write_checkpoint
from crcolony.storage.compaction import compact_encounters
from crcolony.storage.files import lock_file
from crcolony.storage.former_name import rename_former_file
from crcolony.storage.integrity import NAMES, IntegrityReport, check_integrity
from crcolony.storage.rows import (
    Decision,
    StoreState,
    read_decisions,
    read_head,
    read_marks,
    read_open_records,
    read_snapshot,
    read_state,
)
from crcolony.storage.schema import check_not_truncated, create_tables, is_robot_file, migrate
from crcolony.storage.sql import (
    StorageError,
    close_as_one_file,
    insert_or_replace,
    primary_code,
    storage_errors,
)
from crcolony.storage.writing import write_record, write_snapshot

_CACHE_KIB = 64
"""Pages that SQLite keeps in RAM: those that a mating changes. By itself it keeps 2 MB, for each robot of a process."""
_LOG_PAGES = 256
"""The write-ahead log is merged into the main file at 1 MiB; by itself SQLite does so at 4 MiB.

A still shorter log is merged so often that the disk is written to much more."""
_MAX_LOG_BYTES = 5 * 2**18
"""A log that a large transaction has made longer is shortened to this. A usual one is not, it would grow again."""


class StorageFullError(CrcolonyError):
    """A transaction was rolled back, certainly: there is no room, or another process locks the file."""


class RobotStore:
    """The file of one robot, for one process, and in it for one thread at a time."""

    def __init__(
        self,
        path: Path,
        robot: RobotId,
        schema: bytes,
        busy_s: float = 0.3,
        durable: bool = True,
    ) -> None:
        """Open a robot's file, or create it; raises StorageError.

        `schema` is the digest of the robot's genotype schema. Another process that locks the file is waited for
        `busy_s`. Without `durable` a power cut may lose the last transactions.
        """
        self.path = path
        self._is_broken = False
        self._database: sqlite3.Connection | None = None
        self._state: StoreState | None = None
        """None if it must be read from the disk"""
        if path.is_dir():
            raise StorageError(f"{path}: is a folder, not a robot's file")
        self._lock: int | None = lock_file(path)
        try:
            rename_former_file(path)
            with storage_errors(path):
                self._open(robot, schema, busy_s, durable)
        except BaseException:
            self._is_broken = True  # so that closing leaves the file as it is
            self.close()
            raise

    def _open(self, robot: RobotId, schema: bytes, busy_s: float, durable: bool) -> None:
        check_not_truncated(self.path)
        with contextlib.closing(_connect(self.path, busy_s)) as database:
            report = _prepare(database, self.path, robot, schema, durable)
            head, self._damaged = report.head, report.damaged_snapshots
            if head.robot != robot.hex():
                raise StorageError(
                    f"{self.path}: the file of robot {head.robot[:8]}, not of {robot.hex()[:8]}"
                )
            if head.schema != schema:
                raise StorageError(
                    f"{self.path}: its genotypes have another schema than the settings'"
                )
            # What SQLite needed to read the whole file goes with the connection that did it.
            self._database = _connect(self.path, busy_s)
            _set_up(self._database, durable)

    def begin_incarnation(self, unix_s: int) -> int:
        """Write and return the ordinal of this start of the robot.

        It is above that of every earlier start, even if the clock was set back, and above that of a file that was lost,
        if the clock was not.
        """
        with self._transaction() as state:
            state.head.incarnation = max(state.head.incarnation + 1, unix_s)
        return state.head.incarnation

    def write(
        self,
        records: Sequence[EncounterRecord],
        decided: EncounterRecord | None = None,
        decision: Decision | None = None,
    ) -> None:
        """Write records, each in place of the former one of its encounter, and the decision about one of them.

        Raises StorageFullError or FatalStorageError, and ValueError for an encounter that has ended, or is decided.
        """
        if (decided is None) != (decision is None) or (decided and decided not in records):
            raise ValueError("a decision is about one of the records")
        with self._transaction() as state:
            for record in records:
                write_record(
                    self._connection, state, record, decision if record == decided else None
                )

    def save(self, robot: Mapping[str, Any], events: Sequence[Event], tick: int) -> None:
        """Write a snapshot of the whole robot and the events since the last one; the snapshot before it is kept.

        Old encounters are compacted (see `compaction`).

        What came after the newest undamaged snapshot (a damaged one, and its events) is deleted. Raises
        StorageFullError or FatalStorageError.
        """
        file = io.BytesIO()
        write_checkpoint(file, robot)
        with self._transaction() as state:
            base = state.head.base_serial(self._damaged)
            write_snapshot(self._connection, state.head, base, file.getvalue(), events, tick)
            compact_encounters(self._connection, state, base)

    def load(self) -> tuple[dict[str, Any], int] | None:
        """Return the robot of the newest undamaged snapshot and its tick, or None if there is no snapshot.

        Raises StorageError.
        """
        with storage_errors(self.path):
            head = read_head(self._connection)
            for serial in (head.newest, head.older):
                if serial and serial not in self._damaged:
                    try:
                        saved, row = read_snapshot(self._connection, serial)
                    except CheckpointError:
                        self._damaged |= {serial}
                    else:
                        return saved, int(row["tick"])
        if head.newest:
            raise StorageError(f"{self.path}: corrupt: no snapshot can be read")
        return None

    def decisions_since(self) -> list[tuple[EncounterRecord, Decision]]:
        """Return the matings that were decided after the newest undamaged snapshot, in order; raises StorageError."""
        with storage_errors(self.path):
            base = read_head(self._connection).base_serial(self._damaged)
            return read_decisions(self._connection, base)

    def open_records(self) -> list[EncounterRecord]:
        """Return the encounters that wait for their partner, oldest first; raises StorageError."""
        with storage_errors(self.path):
            return read_open_records(self._connection)

    def marks(self) -> dict[RobotId, tuple[tuple[int, int], bool]]:
        """Return the last encounter that each initiator proposed to this robot, and whether it was a mating.

        An encounter is given by the initiator's incarnation and its count. Raises StorageError.
        """
        with storage_errors(self.path):
            return read_marks(self._connection)

    def close(self) -> None:
        """Close the file, as a single one that can be copied and read anywhere, and release its lock."""
        if self._database is not None:
            if self._is_broken:
                self._database.close()
            else:
                close_as_one_file(self._database)
            self._database = None
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    @property
    def _connection(self) -> sqlite3.Connection:
        assert self._database is not None, "the file is closed"
        return self._database

    @contextlib.contextmanager
    def _transaction(self) -> Iterator[StoreState]:
        """Write all of the block or nothing; the block updates the state that is yielded with what it writes."""
        if self._is_broken:
            raise FatalStorageError(f"{self.path}: failed before; start again from the disk")
        # Until all is on the disk, nothing is known for sure, even after a Ctrl-C in the middle.
        state, self._state = self._state, None
        try:
            self._connection.execute("BEGIN IMMEDIATE")
            if state is None:
                state = read_state(self._connection)
            state.head.serial += 1
            yield state
            insert_or_replace(self._connection, NAMES.head, vars(state.head))
            self._connection.execute("COMMIT")
            self._state = state
        except (sqlite3.Error, UnicodeDecodeError) as error:  # as in storage_errors
            self._fail(error)
        except BaseException:
            self._roll_back()
            raise

    def _fail(self, error: Exception) -> NoReturn:
        """Roll back, and raise StorageFullError if nothing was certainly written, FatalStorageError otherwise.

        A transaction counts from its last page in the log on. If there was no room for that page, or it could not be
        written (so SQLite reports a quota and a limit on file sizes), the transaction is not there. After any other
        error, above all of a sync, it may be there or not, and what the system keeps in its cache proves nothing.
        """
        self._roll_back()
        is_certain = (
            primary_code(error) in (sqlite3.SQLITE_FULL, sqlite3.SQLITE_BUSY)
            or getattr(error, "sqlite_errorcode", -1) == sqlite3.SQLITE_IOERR_WRITE
        )
        if is_certain and not self._is_broken:
            raise StorageFullError(f"{self.path}: not written: {error}") from None
        self._is_broken = True
        raise FatalStorageError(f"{self.path}: {error}") from None

    def _roll_back(self) -> None:
        try:
            if self._connection.in_transaction:
                self._connection.execute("ROLLBACK")
        except sqlite3.Error:
            self._is_broken = True


def _connect(path: Path, busy_s: float) -> sqlite3.Connection:
    return sqlite3.connect(path, timeout=busy_s, isolation_level=None, check_same_thread=False)


def _set_up(database: sqlite3.Connection, durable: bool) -> None:
    """Make every transaction durable, and keep memory and log small."""
    database.execute(f"PRAGMA synchronous = {'FULL' if durable else 'OFF'}")
    database.execute("PRAGMA foreign_keys = ON")
    database.execute(f"PRAGMA cache_size = -{_CACHE_KIB}")
    database.execute(f"PRAGMA wal_autocheckpoint = {_LOG_PAGES}")
    database.execute(f"PRAGMA journal_size_limit = {_MAX_LOG_BYTES}")


def _prepare(
    database: sqlite3.Connection, path: Path, robot: RobotId, schema: bytes, durable: bool
) -> IntegrityReport:
    """Create the tables, or migrate those that are there, and check all that is in the file."""
    is_old = is_robot_file(database, path)  # before a file of another program is changed
    _set_up(database, durable)
    (mode,) = database.execute("PRAGMA journal_mode = WAL").fetchone()
    if mode != "wal":
        raise StorageError(
            f"{path}: its file system cannot hold a robot's file (SQLite has no WAL there)"
        )
    if is_old:
        migrate(database, path)
    else:
        create_tables(database, robot.hex(), schema)
        database.execute("PRAGMA wal_checkpoint(TRUNCATE)")  # the main file now has its id
    # A file that is read only is refused here, and not at the first transaction.
    database.execute("BEGIN IMMEDIATE")
    database.execute(f"UPDATE {NAMES.head} SET incarnation = incarnation")
    database.execute("ROLLBACK")
    return check_integrity(database, path)
