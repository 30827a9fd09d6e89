"""A robot's memory: one SQLite file with its encounters and decisions, its history, and snapshots of all of it.

    StorageError                at opening and reading: the memory cannot be used
    StorageFullError                 nothing of this transaction is on the disk: there is no room, or somebody locks the file
    FatalStorageError               nobody knows what is on the disk: stop, and begin again from there

What a method has returned from is on the disk (with `durable`), and a transaction is there whole or not at all.
"""

import contextlib
import fcntl
import io
import os
import sqlite3
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn

import msgspec

from crcolony.errors import Broken, CrcolonyError
from crcolony.evolution.history import Event
from crcolony.protocol.encounters import EncounterRecord
from crcolony.protocol.identity import RobotId
from crcolony.storage.checkpoint import CheckpointError, write_checkpoint
from crcolony.storage.integrity import check
from crcolony.storage.rows import (
    UNDECIDED,
    WAITING,
    Decision,
    Known,
    columns_of,
    decision_of,
    head_of,
    known_of,
    record_of,
    row_of,
    snapshot_of,
)
from crcolony.storage.schema import create, migrate, recognise, refuse_emptied
from crcolony.storage.sql import (
    StorageError,
    insert,
    named_errors,
    primary_code,
    put,
    select,
    update,
)

_encode = msgspec.msgpack.Encoder().encode


class StorageFullError(CrcolonyError):
    """A transaction was rolled back, certainly, for want of room or because somebody locks the file: go on without."""


class FatalStorageError(Broken):
    """Nobody knows whether a transaction is on the disk: the process must stop and begin again from there."""


class RobotStore:
    """The memory of one robot, for one process, and in it for one thread at a time."""

    def __init__(
        self,
        path: Path,
        robot: RobotId,
        schema: bytes,
        busy_s: float = 0.3,
        durable: bool = True,
    ) -> None:
        """Open the file, or make it; raises StorageError. Without `durable` a power cut may take what was written."""
        self.path = path
        self._is_broken = False
        self._database: sqlite3.Connection | None = None
        self._known: Known | None = None
        """None: to be read from the disk"""
        if path.is_dir():
            raise StorageError(f"{path}: is a folder, not a memory")
        self._lock: int | None = _lock(path)
        try:
            with named_errors(path):
                self._open(robot, schema, busy_s, durable)
        except BaseException:
            self._is_broken = True  # so that closing leaves the file as it is
            self.close()
            raise

    def _open(self, robot: RobotId, schema: bytes, busy_s: float, durable: bool) -> None:
        refuse_emptied(self.path)
        self._database = database = sqlite3.connect(
            self.path, timeout=busy_s, isolation_level=None, check_same_thread=False
        )
        is_memory = recognise(database, self.path)  # before anything of somebody else's is touched
        database.execute(f"PRAGMA synchronous = {'FULL' if durable else 'OFF'}")
        database.execute("PRAGMA foreign_keys = ON")
        (mode,) = database.execute("PRAGMA journal_mode = WAL").fetchone()
        if mode != "wal":
            raise StorageError(f"{self.path}: its file system cannot hold a memory (no WAL)")
        if is_memory:
            migrate(database, self.path)
        else:
            create(database, robot.hex(), schema)
            database.execute("PRAGMA wal_checkpoint(TRUNCATE)")  # now the main file says what it is
        database.execute("BEGIN IMMEDIATE")  # a file that may only be read is told here, not later
        database.execute("UPDATE memory SET life = life")
        database.execute("ROLLBACK")
        checked = check(database, self.path)
        head, self._damaged = checked.head, checked.damaged
        if head.robot != robot.hex():
            raise StorageError(
                f"{self.path}: the memory of robot {head.robot[:8]}, not of {robot.hex()[:8]}"
            )
        if head.schema != schema:
            raise StorageError(f"{self.path}: its genomes are of another schema than the settings'")

    def begin_incarnation(self, unix_s: int) -> int:
        """Return the number of this start, on disk by then: it grows though clocks jump and memories get lost."""
        with self._transaction() as known:
            known.head.life = max(known.head.life + 1, unix_s)
        return known.head.life

    def write(
        self,
        records: Sequence[EncounterRecord],
        decided: EncounterRecord | None = None,
        decision: Decision | None = None,
    ) -> None:
        """Write records, each in place of what was known of its encounter, and what was decided about one of them.

        Raises StorageFullError or FatalStorageError, and ValueError for an encounter that was decided about before, or has ended.
        """
        if (decided is None) != (decision is None) or (decided and decided not in records):
            raise ValueError("a decision is about one of the records")
        with self._transaction() as known:
            for record in records:
                self._write_record(record, decision if record == decided else None, known)

    def _write_record(
        self, record: EncounterRecord, decision: Decision | None, known: Known
    ) -> None:
        database, head = self._connection, known.head
        before = known.waiting.pop(record.encounter, None)
        row = row_of(record)
        if before is None:
            known.encounters += 1
            row |= {"seq": known.encounters, **UNDECIDED}
        else:
            head.include(before.pop("digest"))
            row = before | row
        if decision is not None:
            if row["serial"] is not None:
                raise ValueError("it is decided already whether this encounter has offspring")
            row |= columns_of(decision) | {"serial": head.serial}
        if before is not None:
            digest = update(database, "encounters", before, row)
        else:
            try:
                digest = insert(database, "encounters", row)
            except sqlite3.IntegrityError:
                raise ValueError("this encounter has ended already") from None
        head.include(digest)
        if record.is_unresolved:
            known.waiting[record.encounter] = row | {"digest": digest}

    def save(self, robot: Mapping[str, Any], events: Sequence[Event], tick: int) -> None:
        """Write a snapshot of the whole robot, and the events since the last; it and the one before are kept.

        What came after the snapshot that this robot goes on from (a damaged one, and its events) is forgotten.
        """
        file = io.BytesIO()
        write_checkpoint(file, robot)
        with self._transaction() as known:
            database, head = self._connection, known.head
            base = head.base(self._damaged)
            last = self._events_of(base)
            for row in list(select(database, "SELECT digest FROM events WHERE seq > ?", last)):
                head.include(row["digest"])
            database.execute("DELETE FROM events WHERE seq > ?", (last,))
            for seq, event in enumerate(events, last + 1):
                columns = {
                    "seq": seq,
                    "tick": event.tick,
                    "kind": type(event).__name__,
                    "body": _encode(event),
                }
                head.include(insert(database, "events", columns))
            database.execute("DELETE FROM snapshots WHERE serial <> ?", (base,))
            snapshot = {
                "serial": head.serial,
                "tick": tick,
                "taken": int(time.time()),
                "events": last + len(events),
                "robot": file.getvalue(),
            }
            insert(database, "snapshots", snapshot)
            head.newest, head.older = head.serial, base

    def load(self) -> tuple[dict[str, Any], int] | None:
        """Return the newest snapshot that is undamaged, and its tick; None in a new memory. Raises StorageError."""
        with named_errors(self.path):
            head = head_of(self._connection)
            for serial in (head.newest, head.older):
                if serial and serial not in self._damaged:
                    try:
                        saved, row = snapshot_of(self._connection, serial)
                    except CheckpointError:
                        self._damaged |= {serial}
                    else:
                        return saved, int(row["tick"])
        if head.newest:
            raise StorageError(f"{self.path}: corrupt: no snapshot can be understood")
        return None

    def decisions_since(self) -> list[tuple[EncounterRecord, Decision]]:
        """Return the matings decided after the newest undamaged snapshot, in order: it does not know of them."""
        query = "SELECT * FROM encounters WHERE serial > ? ORDER BY serial"
        decisions = []
        with named_errors(self.path):
            for row in select(self._connection, query, self._base):
                decision = decision_of(row)
                assert decision is not None, "a row with a serial holds a decision"
                decisions.append((record_of(row), decision))
        return decisions

    def open_records(self) -> list[EncounterRecord]:
        """Return the encounters that wait for their partner, oldest first."""
        with named_errors(self.path):
            return [record_of(row) for row in select(self._connection, WAITING)]

    def marks(self) -> dict[RobotId, tuple[tuple[int, int], bool]]:
        """Return, of every initiator, its last encounter that this robot was prepared for, and whether it mated."""
        query = """
            SELECT initiator, life, count, state FROM encounters WHERE role = 'responder'
            ORDER BY life, count
        """
        with named_errors(self.path):
            return {
                bytes.fromhex(initiator): ((incarnation, count), state == "mated")
                for initiator, incarnation, count, state in self._connection.execute(query)
            }

    def close(self) -> None:
        """Let the file go, as one that can be copied and read anywhere."""
        if self._database is not None:
            if not self._is_broken:
                with contextlib.suppress(sqlite3.Error):  # somebody reads it, or the disk is full
                    self._database.execute("PRAGMA journal_mode = DELETE")
            self._database.close()
            self._database = None
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    @property
    def _connection(self) -> sqlite3.Connection:
        assert self._database is not None, "the memory is closed"
        return self._database

    @property
    def _base(self) -> int:
        """The serial of the snapshot that this robot goes on from, or 0."""
        return head_of(self._connection).base(self._damaged)

    def _events_of(self, serial: int) -> int:
        """Return how many events there were at a snapshot."""
        query = "SELECT events FROM snapshots WHERE serial = ?"
        row = self._connection.execute(query, (serial,)).fetchone()
        return int(row[0]) if row else 0

    @contextlib.contextmanager
    def _transaction(self) -> Iterator[Known]:
        """Write all of it or nothing; what is yielded is to be brought up to date with what is written."""
        if self._is_broken:
            raise FatalStorageError(f"{self.path}: broken before; begin again from the disk")
        # Until all is on the disk, nothing else is known for sure, even after a Ctrl-C in the middle.
        known, self._known = self._known, None
        try:
            self._connection.execute("BEGIN IMMEDIATE")
            if known is None:
                known = known_of(self._connection)
            known.head.serial += 1
            yield known
            put(self._connection, "memory", vars(known.head))
            self._connection.execute("COMMIT")
            self._known = known
        except (sqlite3.Error, UnicodeDecodeError) as error:  # see named_errors
            self._fail(error)
        except BaseException:
            self._roll_back()
            raise

    def _fail(self, error: Exception) -> NoReturn:
        """Go back to what was, if that is certain, and say which it is.

        A transaction counts from its last page in the log on. If there was no room for that page, or it could not be
        written (SQLite calls a quota and a limit on file sizes so), the transaction is not there. After any other
        error, of a sync above all, it may be or not, and what the system keeps in its cache proves nothing.
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


def _lock(path: Path) -> int:
    """Keep other processes out, by a file beside the memory: SQLite's own locks let them take turns."""
    side = path.with_name(path.name + ".lock")
    try:
        lock = os.open(side, os.O_RDWR | os.O_CREAT, 0o644)
    except OSError as error:
        raise StorageError(f"{path}: cannot be written: {error.strerror}") from None
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        holder = os.pread(lock, 20, 0).decode("ascii", "replace").strip()
        os.close(lock)
        is_taken = isinstance(error, BlockingIOError)
        reason = f"cannot be locked: {error.strerror}"
        if is_taken:
            reason = f"in use by another process{f' ({holder})' if holder else ''}"
        raise StorageError(f"{path}: {reason}") from None
    with contextlib.suppress(OSError):  # who it is helps a person; on a full disk it stays unsaid
        os.ftruncate(lock, 0)
        os.pwrite(lock, f"pid {os.getpid()}\n".encode(), 0)
    return lock
