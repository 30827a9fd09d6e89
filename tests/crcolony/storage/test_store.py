"""A robot's store keeps what is written, refuses files it cannot use, and continues after a disk was full."""

import ctypes
import gc
import signal
import sqlite3
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from crcolony.errors import FatalStorageError
from crcolony.storage.files import log_of
from crcolony.storage.reading import read_stored_robot
from crcolony.storage.sql import StorageError
from crcolony.storage.store import RobotStore, StorageFullError
from tests.support.robot_stores import (
    ME,
    OTHER,
    PEER,
    SCHEMA,
    answered,
    decision,
    events,
    mate,
    open_store,
    proposed,
    robot,
    room_for,
    see,
)

LIBC = ctypes.CDLL(None)


class Mallinfo(ctypes.Structure):
    """`struct mallinfo2` of the GNU C library."""

    _fields_ = tuple((f"field{k}", ctypes.c_size_t) for k in range(10))


def allocated_bytes() -> int:
    """Return what all code of this process has allocated of the C library, small Python objects apart."""
    gc.collect()
    LIBC.mallinfo2.restype = Mallinfo
    info = LIBC.mallinfo2()
    return int(info.field7 + info.field4)  # in the heap, and in mappings of its own


def test_a_new_file_is_empty(tmp_path: Path) -> None:
    """It holds no snapshot, no decision, no open encounter and no encounter of another robot."""
    store = open_store(tmp_path / "robot.sqlite")
    assert store.load() is None
    assert (store.decisions_since(), store.open_records(), store.marks()) == ([], [], {})
    store.close()


def test_what_is_written_is_read_unchanged(tmp_path: Path) -> None:
    """Records with and without partner, decisions, events and the whole robot, by the robot and by readers."""
    path = tmp_path / "robot.sqlite"
    store = open_store(path, durable=True)
    incarnation = store.begin_incarnation(1000)
    alone = replace(answered(1), partner=None, proof=b"", orphaned=True)
    store.write([alone])
    mated = mate(store, 2)
    store.save(robot(3), events(3), tick=30)
    store.close()
    store = open_store(path)
    saved, tick = store.load() or ({}, 0)
    assert tick == 30
    np.testing.assert_array_equal(saved["arrays"]["weights"], robot(3)["arrays"]["weights"])
    stored = read_stored_robot(path)
    store.close()
    assert (stored.robot, stored.incarnation, stored.schema) == (ME, incarnation, SCHEMA)
    assert stored.matings == [(alone, None), (mated, decision(2))]
    assert stored.events == events(3)
    assert (stored.tick, stored.generation) == (30, 3)
    assert stored.saved_unix_s is not None
    (offspring,) = stored.pool
    assert (offspring.genes.tolist(), offspring.mother, offspring.step) == ([3.0, 3.0], "me/1", 3)


def test_marks_are_the_last_encounter_of_every_initiator(tmp_path: Path) -> None:
    """The one of the latest incarnation and highest count, in any order of writing, and whether it was a mating."""
    store = open_store(tmp_path / "robot.sqlite")
    later = answered(1, "aborted")
    later = replace(later, encounter=type(later.encounter)(PEER, ME, 8, 1))
    store.write([later])
    store.write([answered(9, "mated"), answered(4, "mated", peer=OTHER), proposed(30)])
    assert store.marks() == {PEER: ((8, 1), False), OTHER: ((7, 4), True)}
    store.close()


def test_an_incarnation_is_above_every_earlier_one(tmp_path: Path) -> None:
    """Even if the clock is set back, and even if an earlier file was lost."""
    path = tmp_path / "robot.sqlite"
    incarnations = []
    for unix_s in (1000, 2000, 5, 2000, 3000):
        store = open_store(path)
        incarnations.append(store.begin_incarnation(unix_s))
        store.close()
    assert incarnations == [1000, 2000, 2001, 2002, 3000]
    path.unlink()
    store = open_store(path)
    assert store.begin_incarnation(3001) == 3001
    store.close()


def test_decisions_after_the_snapshot_are_returned_in_order(tmp_path: Path) -> None:
    """Those that the snapshot includes are not returned, so that no offspring is lost and none is counted twice."""
    path = tmp_path / "robot.sqlite"
    store = open_store(path)
    mate(store, 1)
    store.save(robot(1), events(1), tick=1)
    records = [mate(store, number) for number in (5, 3, 4)]
    store.close()
    store = open_store(path)
    assert [record for record, _ in store.decisions_since()] == records
    store.save(robot(2), [], tick=2)
    assert store.decisions_since() == []
    store.close()


def test_a_damaged_snapshot_is_replaced_by_the_one_before(tmp_path: Path) -> None:
    """Its events are deleted, since they are repeated; decisions since the older snapshot are returned."""
    path = tmp_path / "robot.sqlite"
    store = open_store(path)
    store.save(robot(1), events(1), tick=1)
    record = mate(store, 1)
    store.save(robot(2), events(2), tick=2)
    newest = "(SELECT newest FROM head)"
    store._connection.execute(f"UPDATE snapshots SET robot = x'00' WHERE serial = {newest}")
    store.close()
    store = open_store(path)
    saved, tick = store.load() or ({}, 0)
    assert (tick, saved["generation"]) == (1, 1)
    assert store.decisions_since() == [(record, decision(1))]
    assert read_stored_robot(path).events == events(1)
    store.save(robot(3), events(3)[:1], tick=3)
    assert (see(store).tick, read_stored_robot(path).events) == (3, events(1) + events(3)[:1])
    store.close()
    store = open_store(path)
    assert see(store).tick == 3
    store._connection.execute("UPDATE snapshots SET robot = x'00'")
    store.close()
    with pytest.raises(StorageError, match="no snapshot is undamaged"):
        open_store(path)


WRITER = """
import sys
from pathlib import Path
from tests.support.robot_stores import *
store = open_store(Path(sys.argv[1]), durable=True)
for number in range(10**9):
    record = proposed(number)
    store.write([record], record, decision(number))
    if number % 5 == 0:
        store.save(robot(number), events(number), tick=number)
    print(number, flush=True)
"""


def test_what_was_acknowledged_survives_kill(tmp_path: Path) -> None:
    """A process killed at any moment loses nothing that it reported as written, and at most one more is there."""
    path = tmp_path / "robot.sqlite"
    for stop in (1, 7, 23):
        path.unlink(missing_ok=True)
        command = [sys.executable, "-c", WRITER, str(path)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            for line in process.stdout:
                if int(line) == stop:
                    process.send_signal(signal.SIGKILL)
                    break
            reported = [stop, *(int(line) for line in process.stdout if line.endswith("\n"))][-1]
        store = open_store(path)
        numbers = [record.nonce for record, _ in read_stored_robot(path).matings]
        assert numbers in (list(range(reported + 1)), list(range(reported + 2)))
        tick = see(store).tick
        assert tick in (reported - reported % 5, reported + 1)
        since = [record.nonce for record, _ in store.decisions_since()]
        assert since == [number for number in numbers if number > tick]
        store.close()


@pytest.mark.parametrize("limit", ["file size", "pages"])
def test_a_full_disk_is_reported_and_nothing_is_half_written(tmp_path: Path, limit: str) -> None:
    """The robot continues without the transaction; once there is room again it writes as before."""
    path = tmp_path / "robot.sqlite"
    store = open_store(path)
    mate(store, 1)
    before = see(store)
    if limit == "file size":
        with room_for(path.with_name(path.name + "-wal").stat().st_size):
            for number in (2, 3):
                with pytest.raises(StorageFullError, match="not written"):
                    mate(store, number)
    else:
        store._connection.execute("PRAGMA max_page_count = 1")
        with pytest.raises(StorageFullError, match="full"):
            store.save({"arrays": {"weights": np.ones(9000)}}, [], tick=9)
        store._connection.execute("PRAGMA max_page_count = 1000000")
    assert see(store) == before
    mate(store, 4)
    store.save(robot(4), events(4), tick=4)
    store.close()
    store = open_store(path)
    assert [record.nonce for record, _ in see(store).matings] == [1, 4]
    store.close()


def test_a_locked_file_is_like_a_full_disk(tmp_path: Path) -> None:
    """A process that keeps the file locked costs the robot a mating, and does not stop it."""
    path = tmp_path / "robot.sqlite"
    store = RobotStore(path, ME, SCHEMA, busy_s=0.01, durable=False)
    other = sqlite3.connect(path, isolation_level=None)
    other.execute("BEGIN EXCLUSIVE")
    with pytest.raises(StorageFullError, match="locked"):
        mate(store, 1)
    other.execute("ROLLBACK")
    other.close()
    record = mate(store, 1)
    assert [seen for seen, _ in store.decisions_since()] == [record]
    store.close()


class FailingSync:
    """A connection whose commit writes, and then reports that the disk could not be synced."""

    def __init__(self, connection: sqlite3.Connection) -> None:
        self._connection = connection

    def __getattr__(self, name: str) -> Any:
        return getattr(self._connection, name)

    def execute(self, statement: str, *values: Any) -> sqlite3.Cursor:
        cursor = self._connection.execute(statement, *values)
        if statement == "COMMIT":
            error = sqlite3.OperationalError("disk I/O error")
            error.sqlite_errorcode = sqlite3.SQLITE_IOERR_FSYNC
            raise error
        return cursor


def test_after_a_failed_sync_nothing_more_is_written(tmp_path: Path) -> None:
    """Nobody knows what is on the disk, so the store refuses to write until the file is opened again and read."""
    path = tmp_path / "robot.sqlite"
    store = open_store(path)
    whole = store._connection
    store._database = FailingSync(whole)  # type: ignore[assignment]
    with pytest.raises(FatalStorageError, match="disk I/O error"):
        mate(store, 1)
    store._database = whole
    with pytest.raises(FatalStorageError, match="start again"):
        mate(store, 2)
    store.close()
    store = open_store(path)
    assert [record.nonce for record, _ in store.decisions_since()] == [1]
    store.close()


def test_the_log_stays_short(tmp_path: Path) -> None:
    """It is merged into the file at one mebibyte, and a snapshot that is larger makes it longer for a while only."""
    path = tmp_path / "robot.sqlite"
    store = open_store(path)
    large = {"weights": np.random.default_rng(0).normal(size=400_000)}
    store.save(large, [], 0)
    assert log_of(path).stat().st_size > 2**21
    for number in range(1, 400):
        mate(store, number)
    assert log_of(path).stat().st_size <= 1.25 * 2**20
    store.close()


@pytest.mark.skipif(not hasattr(LIBC, "mallinfo2"), reason="needs the GNU C library")
def test_an_open_store_takes_little_memory(tmp_path: Path) -> None:
    """So many hundred robots fit into one process: none of their snapshots stays in memory."""
    stores = [open_store(tmp_path / f"{number}.sqlite") for number in range(2)]
    for store in stores:  # what is allocated once
        store.save({"weights": np.zeros(100_000) + 1.0}, [], 0)
    before = allocated_bytes()
    stores += [open_store(tmp_path / f"{number}.sqlite") for number in range(2, 12)]
    for tick in range(3):
        for store in stores:
            store.save({"weights": np.random.default_rng(tick).normal(size=100_000)}, [], tick)
    assert (allocated_bytes() - before) / 10 < 350_000
    for store in stores:
        store.close()


def test_a_file_is_for_one_process(tmp_path: Path) -> None:
    """A second store is refused, also in another process; when the first is closed (even twice) the file is free."""
    path = tmp_path / "robot.sqlite"
    store = open_store(path)
    with pytest.raises(StorageError, match=r"robot\.sqlite: in use by another process"):
        open_store(path)
    command = [sys.executable, "-c", WRITER, str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert "in use by another process" in done.stderr.splitlines()[-1]
    store.close()
    store.close()
    open_store(path).close()


def test_the_file_of_another_robot_or_schema_is_refused(tmp_path: Path) -> None:
    """Both are named, and the file stays as it was."""
    path = tmp_path / "robot.sqlite"
    open_store(path).close()
    with pytest.raises(StorageError, match="the file of robot 6d6d6d6d, not of 6f6f6f6f"):
        RobotStore(path, OTHER, SCHEMA)
    with pytest.raises(StorageError, match="another schema"):
        RobotStore(path, ME, bytes(16))
    open_store(path).close()


@pytest.mark.parametrize("what", ["folder", "file"])
def test_a_folder_or_file_that_is_read_only_is_refused(tmp_path: Path, what: str) -> None:
    """Root may write anywhere, so a process of the user `nobody` tries."""
    open_store(tmp_path / "robot.sqlite").close()
    (tmp_path / "robot.sqlite.lock").chmod(0o666)
    (tmp_path / "robot.sqlite").chmod(0o444)
    tmp_path.chmod(0o555 if what == "folder" else 0o777)
    name = "new.sqlite" if what == "folder" else "robot.sqlite"
    script = f"""
import os
from pathlib import Path
from tests.support.robot_stores import *
os.chdir({str(tmp_path)!r})
if os.getuid() == 0:
    os.setuid(65534)
open_store(Path({name!r}))
"""
    command = [sys.executable, "-c", script]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    tmp_path.chmod(0o755)
    assert f"StorageError: {name}: cannot be" in done.stderr.splitlines()[-1]
