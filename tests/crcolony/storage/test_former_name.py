"""A robot whose folder still holds `memory.sqlite` keeps everything that is in it."""

import contextlib
import os
import shutil
import sqlite3
import subprocess
import sys
from pathlib import Path

import pytest

from crcolony.storage.files import lock_file
from crcolony.storage.reading import read_stored_robot
from crcolony.storage.sql import StorageError
from tests.support.robot_stores import (
    answered,
    decision,
    events,
    mate,
    open_store,
    proposed,
    robot,
    room_for,
    see,
    write_version_1,
)

KILLED = """
import os, sys
from pathlib import Path
from tests.support.robot_stores import *
store = open_store(Path(sys.argv[1]), durable=True)
mate(store, 1)
os._exit(0)
"""


def names_in(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def leave_log(folder: Path) -> None:
    """Write `memory.sqlite` as a process that was killed leaves it: its last mating is in the log alone."""
    command = [sys.executable, "-c", KILLED, str(folder / "memory.sqlite")]
    subprocess.run(command, check=True)
    assert (folder / "memory.sqlite-wal").stat().st_size > 0


def test_a_file_of_version_1_is_renamed_and_migrated(tmp_path: Path) -> None:
    """It has its present name from then on, and all that was in it."""
    write_version_1(tmp_path / "memory.sqlite")
    (tmp_path / "memory.sqlite.lock").write_text("pid 1\n")
    for _ in range(2):
        store = open_store(tmp_path / "robot.sqlite")
        assert store.decisions_since() == [(proposed(1), decision(1))]
        assert store.open_records() == [proposed(1), answered(2)]
        store.close()
    assert names_in(tmp_path) == ["robot.sqlite", "robot.sqlite.lock"]


def test_what_is_in_the_log_alone_is_kept(tmp_path: Path) -> None:
    """The log is merged before the file is renamed."""
    leave_log(tmp_path)
    store = open_store(tmp_path / "robot.sqlite")
    assert store.decisions_since() == [(proposed(1), decision(1))]
    store.close()
    assert names_in(tmp_path) == ["robot.sqlite", "robot.sqlite.lock"]


def test_a_file_that_another_process_has_is_left_alone(tmp_path: Path) -> None:
    """A process of an older version holds the lock of the former name."""
    write_version_1(tmp_path / "memory.sqlite")
    content = (tmp_path / "memory.sqlite").read_bytes()
    lock = lock_file(tmp_path / "memory.sqlite")
    with pytest.raises(StorageError, match=r"memory\.sqlite: in use by another process"):
        open_store(tmp_path / "robot.sqlite")
    os.close(lock)
    assert (tmp_path / "memory.sqlite").read_bytes() == content
    assert not (tmp_path / "robot.sqlite").exists()
    open_store(tmp_path / "robot.sqlite").close()


def test_a_file_that_is_being_read_is_renamed_later(tmp_path: Path) -> None:
    """As long as another program reads it the log cannot be merged, and the robot refuses to start."""
    leave_log(tmp_path)
    with contextlib.closing(sqlite3.connect(tmp_path / "memory.sqlite")) as reader:
        reader.execute("BEGIN")
        reader.execute("SELECT * FROM encounters").fetchone()
        with pytest.raises(StorageError, match=r"memory\.sqlite: in use by another process"):
            open_store(tmp_path / "robot.sqlite")
    assert not (tmp_path / "robot.sqlite").exists()
    store = open_store(tmp_path / "robot.sqlite")
    assert store.decisions_since() == [(proposed(1), decision(1))]
    store.close()


def test_a_file_of_the_present_name_is_preferred(tmp_path: Path) -> None:
    """The other one is left as it is."""
    store = open_store(tmp_path / "robot.sqlite")
    mate(store, 7)
    store.close()
    write_version_1(tmp_path / "memory.sqlite")
    content = (tmp_path / "memory.sqlite").read_bytes()
    store = open_store(tmp_path / "robot.sqlite")
    assert store.decisions_since() == [(proposed(7), decision(7))]
    store.close()
    assert (tmp_path / "memory.sqlite").read_bytes() == content


@pytest.mark.parametrize("damage", ["text", "foreign", "flip", "truncated", "newer"])
def test_a_file_that_cannot_be_used_is_neither_renamed_nor_replaced(
    tmp_path: Path, damage: str
) -> None:
    """A robot never starts with a new, empty file beside one that it cannot read."""
    path = tmp_path / "memory.sqlite"
    leave_log(tmp_path)
    if damage == "text":
        path.write_text("no database at all " * 100)
    elif damage == "foreign":
        path.unlink()
        with contextlib.closing(sqlite3.connect(path)) as database:
            database.execute("CREATE TABLE mine (precious TEXT)")
    elif damage == "truncated":
        path.write_bytes(b"")
    else:
        statement = (
            "UPDATE encounters SET tick = 9" if damage == "flip" else "PRAGMA user_version = 99"
        )
        with contextlib.closing(sqlite3.connect(path)) as database, database:
            database.execute(statement)
    content = path.read_bytes()
    with pytest.raises(StorageError) as refused:
        open_store(tmp_path / "robot.sqlite")
    assert str(refused.value).startswith(f"{path}: ")
    assert "\n" not in str(refused.value)
    assert path.read_bytes() == content
    assert not (tmp_path / "robot.sqlite").exists()


def test_the_log_of_a_missing_file_is_not_applied_to_the_renamed_one(tmp_path: Path) -> None:
    """It is of another file, and its pages would damage this one."""
    write_version_1(tmp_path / "memory.sqlite")
    (tmp_path / "robot.sqlite-wal").write_bytes(b"pages of another file")
    with pytest.raises(StorageError, match=r"robot\.sqlite-wal: the file it belongs to is missing"):
        open_store(tmp_path / "robot.sqlite")
    assert (tmp_path / "memory.sqlite").exists()


def test_a_full_disk_loses_nothing(tmp_path: Path) -> None:
    """Whichever write fails, the content is there under one of the names, and the robot starts once there is room."""
    source = tmp_path / "source"
    source.mkdir()
    store = open_store(source / "memory.sqlite")
    store.save(robot(1), events(1), tick=1)
    store.close()
    with contextlib.closing(sqlite3.connect(source / "memory.sqlite")) as database:
        database.execute("PRAGMA journal_mode = WAL")
    record, failures = proposed(1), 0
    for size in range(0, 40 * 4096, 2060):
        folder = tmp_path / str(size)
        shutil.copytree(source, folder)
        leave_log(folder)
        with contextlib.suppress(StorageError), room_for(size):
            open_store(folder / "robot.sqlite").close()
            break
        failures += 1
        assert read_stored_robot(folder / "robot.sqlite").matings == [(record, decision(1))]
        store = open_store(folder / "robot.sqlite")
        assert see(store).matings == ((record, decision(1)),)
        store.close()
    assert failures > 3


def test_readers_find_the_former_name(tmp_path: Path) -> None:
    """They ask for the present name, and rename nothing."""
    write_version_1(tmp_path / "memory.sqlite")
    stored = read_stored_robot(tmp_path / "robot.sqlite")
    assert stored.events == events(1)
    assert read_stored_robot(tmp_path / "memory.sqlite").events == events(1)
    assert names_in(tmp_path) == ["memory.sqlite"]
