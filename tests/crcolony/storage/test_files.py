"""Files are replaced as a whole, robots' files are found, and locks keep other processes out."""

import os
from pathlib import Path

import pytest

from crcolony.storage.files import (
    FolderError,
    existing_robot_file,
    lock_file,
    lock_folder,
    make_folder,
    robot_files_of_run,
)
from crcolony.storage.sql import StorageError


def test_a_folder_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    """A file is in the way."""
    make_folder(tmp_path / "a" / "b")
    assert (tmp_path / "a" / "b").is_dir()
    (tmp_path / "file").touch()
    with pytest.raises(FolderError, match=f"{tmp_path / 'file'}: cannot be made: File exists"):
        make_folder(tmp_path / "file")


def test_a_robots_file_is_found_under_either_name(tmp_path: Path) -> None:
    """The former name counts only if there is no file of the present one; other names are never changed."""
    present, former = tmp_path / "robot.sqlite", tmp_path / "memory.sqlite"
    assert existing_robot_file(present) == present
    former.touch()
    assert existing_robot_file(present) == former
    assert existing_robot_file(tmp_path / "other.sqlite") == tmp_path / "other.sqlite"
    present.touch()
    assert existing_robot_file(present) == present


def test_the_robots_of_a_run_are_found_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    """Folders without a file, and folders of other names, do not count."""
    for name in ("robots/10/robot.sqlite", "robots/9/memory.sqlite", "robots/backup/robot.sqlite"):
        (tmp_path / name).parent.mkdir(parents=True)
        (tmp_path / name).touch()
    (tmp_path / "robots" / "11").mkdir()
    assert robot_files_of_run(tmp_path) == [
        tmp_path / "robots/9/memory.sqlite",
        tmp_path / "robots/10/robot.sqlite",
    ]
    assert robot_files_of_run(tmp_path / "robots") == []


def test_a_locked_file_names_the_process_that_has_it(tmp_path: Path) -> None:
    """When its descriptor is closed the lock is free."""
    path = tmp_path / "robot.sqlite"
    lock = lock_file(path)
    with pytest.raises(StorageError, match=rf"in use by another process \(pid {os.getpid()}\)"):
        lock_file(path)
    os.close(lock)
    os.close(lock_file(path))
    with pytest.raises(StorageError, match="cannot be written"):
        lock_file(tmp_path / "missing" / "robot.sqlite")


def test_a_locked_folder_is_refused(tmp_path: Path) -> None:
    """So is one that does not exist."""
    lock = lock_folder(tmp_path)
    with pytest.raises(FolderError, match="in use by another run"):
        lock_folder(tmp_path)
    os.close(lock)
    os.close(lock_folder(tmp_path))
    with pytest.raises(FolderError, match="cannot be opened"):
        lock_folder(tmp_path / "missing")
