"""Files and folders: what they are called, and how other processes are kept out."""

import contextlib
import fcntl
import os
from pathlib import Path

from crcolony.errors import CrcolonyError
from crcolony.storage.sql import StorageError

ROBOT_FILE = "robot.sqlite"
"""The SQLite file in a robot's folder."""
FORMER_ROBOT_FILE = "memory.sqlite"
"""What `ROBOT_FILE` was called before version 2 of its schema."""
KEY_FILE = "key"
"""The secret key in a robot's folder."""
KNOWN_ARENAS_FILE = "known_arenas"
"""The arenas in which a robot lives, in its folder."""
ARENA_KEY_FILE = "arena_key"
"""The secret key of an arena, in its folder or that of its host."""
ARENA_CHECKPOINT = "arena.npz"
"""The checkpoint in an arena's folder."""


class FileInUseError(StorageError):
    """Another process has locked a file."""


class FolderError(CrcolonyError):
    """A results folder cannot be read or written: the message names the file and the reason."""


def make_folder(folder: Path) -> None:
    """Make a folder and its parents; raises FolderError if that is impossible."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FolderError(f"{folder}: cannot be made: {error.strerror}") from None


def existing_robot_file(path: Path) -> Path:
    """Return the path of a robot's file: under its former name, if it exists under that name alone."""
    former = path.with_name(FORMER_ROBOT_FILE)
    is_former = path.name == ROBOT_FILE and not path.exists() and former.is_file()
    return former if is_former else path


def robot_files_of_run(folder: Path) -> list[Path]:
    """Return the files of all robots of a run, whatever their name, in the order of the robots' numbers."""
    folders = [own for own in (folder / "robots").glob("*") if own.name.isdecimal()]
    files = [
        existing_robot_file(own / ROBOT_FILE)
        for own in sorted(folders, key=lambda own: int(own.name))
    ]
    return [path for path in files if path.exists()]


def log_of(path: Path) -> Path:
    """Return the path of a database's write-ahead log."""
    return path.with_name(path.name + "-wal")


def lock_of(path: Path) -> Path:
    """Return the path of the file that `lock_file` locks."""
    return path.with_name(path.name + ".lock")


def lock_file(path: Path) -> int:
    """Lock a robot's file for this process and return the descriptor that holds the lock until it is closed.

    A file beside it is locked: SQLite's own locks let processes take turns. Raises FileInUseError, StorageError.
    """
    try:
        lock = os.open(lock_of(path), os.O_RDWR | os.O_CREAT, 0o644)
    except OSError as error:
        raise StorageError(f"{path}: cannot be written: {error.strerror}") from None
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        holder = os.pread(lock, 20, 0).decode("ascii", "replace").strip()
        os.close(lock)
        if isinstance(error, BlockingIOError):
            who = f" ({holder})" if holder else ""
            raise FileInUseError(f"{path}: in use by another process{who}") from None
        raise StorageError(f"{path}: cannot be locked: {error.strerror}") from None
    with contextlib.suppress(OSError):  # the pid only helps a person; a full disk must not matter
        os.ftruncate(lock, 0)
        os.pwrite(lock, f"pid {os.getpid()}\n".encode(), 0)
    return lock


def lock_folder(folder: Path) -> int:
    """Lock a results folder for this process and return the descriptor that holds the lock until it is closed.

    Raises FolderError if another process has it, or if it cannot be opened.
    """
    try:
        lock = os.open(folder, os.O_RDONLY)
    except OSError as error:
        raise FolderError(f"{folder}: cannot be opened: {error.strerror}") from None
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        os.close(lock)
        reason = f"cannot be locked: {error.strerror}"
        if isinstance(error, BlockingIOError):
            reason = "in use by another run"
        raise FolderError(f"{folder}: {reason}") from None
    return lock
