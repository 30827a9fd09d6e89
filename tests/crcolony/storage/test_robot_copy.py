"""A robot's file is copied at one moment while the robot writes, and a damaged one is refused."""

import threading
from pathlib import Path

import pytest

from crcolony.storage.reading import read_stored_robot
from crcolony.storage.robot_copy import check_robot_file, copy_robot_file
from crcolony.storage.sql import StorageError
from tests.support.robot_stores import (
    ME,
    events,
    mate,
    open_store,
    robot,
    room_for,
    write_version_1,
)


def test_a_copy_is_of_one_moment_while_the_robot_writes(tmp_path: Path) -> None:
    """Each is sound and holds all that was written before it began; the robot is not held up by any of them."""
    store = open_store(tmp_path / "robot.sqlite")
    store.begin_incarnation(1000)
    is_over = threading.Event()
    written = 0

    def copy_often() -> None:
        number = 0
        while not is_over.is_set() or number < 3:
            number += 1
            before = written
            copied = copy_robot_file(store.path, tmp_path / f"copy-{number}")
            assert copied.encounters >= before
            assert len(read_stored_robot(tmp_path / f"copy-{number}").matings) == copied.encounters

    failures: list[BaseException] = []

    def run() -> None:
        try:
            copy_often()
        except BaseException as failure:
            failures.append(failure)

    thread = threading.Thread(target=run)
    thread.start()
    for number in range(1, 400):
        mate(store, number)
        written = number
        if number % 50 == 0:
            store.save(robot(number), events(number), tick=number)
    is_over.set()
    thread.join()
    store.close()
    assert failures == []


def test_a_copy_is_one_file_for_its_owner_alone(tmp_path: Path) -> None:
    """No log beside it, and it says whose it is."""
    store = open_store(tmp_path / "robot.sqlite")
    store.begin_incarnation(1000)
    mate(store, 1)
    copied = copy_robot_file(store.path, tmp_path / "copies")
    store.close()
    assert (copied.id, copied.incarnation, copied.encounters) == (ME.hex(), 1000, 1)
    assert [path.name for path in tmp_path.glob("copies*")] == ["copies"]
    assert (tmp_path / "copies").stat().st_mode & 0o777 == 0o600


def test_a_damaged_file_is_refused(tmp_path: Path) -> None:
    """A flipped bit in a row: a backup of damage would replace a sound one."""
    store = open_store(tmp_path / "robot.sqlite")
    mate(store, 1)
    store.close()
    data = bytearray(store.path.read_bytes())
    data[data.index(b"a letter")] ^= 1
    store.path.write_bytes(data)
    with pytest.raises(StorageError, match="corrupt"):
        copy_robot_file(store.path, tmp_path / "copy")


@pytest.mark.parametrize("content", [b"", b"no database", b"SQLite format 3\0" + bytes(100)])
def test_what_is_no_robots_file_is_refused(tmp_path: Path, content: bytes) -> None:
    """In one line with its path."""
    (tmp_path / "robot.sqlite").write_bytes(content)
    with pytest.raises(StorageError, match=r"robot\.sqlite: "):
        copy_robot_file(tmp_path / "robot.sqlite", tmp_path / "copy")
    with pytest.raises(StorageError, match=r"robot\.sqlite: "):
        check_robot_file(tmp_path / "robot.sqlite")


def test_a_file_of_version_1_is_copied_as_it_is(tmp_path: Path) -> None:
    """It is migrated when its robot starts, not here."""
    write_version_1(tmp_path / "memory.sqlite")
    copied = copy_robot_file(tmp_path / "memory.sqlite", tmp_path / "copy")
    assert copied == check_robot_file(tmp_path / "copy")
    assert copied.encounters > 0


def test_a_full_disk_is_said_with_the_file_that_has_no_room(tmp_path: Path) -> None:
    """That of the copy, and the robot's own is as it was."""
    store = open_store(tmp_path / "robot.sqlite")
    for number in range(1, 60):
        mate(store, number)
    store.close()
    with room_for(8192), pytest.raises(StorageError, match=r"copy: .*(disk|written)"):
        copy_robot_file(store.path, tmp_path / "copy")
    assert len(read_stored_robot(store.path).matings) == 59
