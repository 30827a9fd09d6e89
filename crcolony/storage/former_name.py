"""Gives a robot's file that still has its former name (`FORMER_ROBOT_FILE`) the present one."""

import os
import sqlite3
from contextlib import closing
from pathlib import Path

from crcolony.durable_files import sync_folder
from crcolony.storage.files import existing_robot_file, lock_file, lock_of, log_of
from crcolony.storage.integrity import check_integrity
from crcolony.storage.schema import check_not_truncated, is_robot_file, names_in
from crcolony.storage.sql import StorageError, connect_read_only, storage_errors

_BUSY_S = 0.3


def rename_former_file(path: Path) -> None:
    """Rename a robot's file to `path` if it exists under its former name alone; raises StorageError.

    The caller holds the lock of `path`. The lock of the former name is needed too, since a process of an older
    version may have the file open. The log is merged first, so that one atomic rename moves everything; a damaged
    file is left as it is.
    """
    former = existing_robot_file(path)
    if former == path:
        return
    _check_no_leftovers(path)
    lock = lock_file(former)
    try:
        check_not_truncated(former)
        with storage_errors(former):
            _check(former)
            _merge_log(former)
        former.rename(path)
        sync_folder(path.parent)
        lock_of(former).unlink(missing_ok=True)
    except OSError as error:
        raise StorageError(f"{former}: cannot be renamed: {error.strerror}") from None
    finally:
        os.close(lock)


def _check_no_leftovers(path: Path) -> None:
    """Raise StorageError for the log or journal of a missing file: SQLite would apply it to the renamed one."""
    for leftover in (log_of(path), path.with_name(path.name + "-journal")):
        if leftover.exists() and leftover.stat().st_size > 0:
            raise StorageError(f"{leftover}: the file it belongs to is missing")


def _check(path: Path) -> None:
    """Raise StorageError if a file is damaged or not a robot's file."""
    with closing(connect_read_only(path)) as database:
        if is_robot_file(database, path):
            check_integrity(database, path, names_in(database, path))


def _merge_log(path: Path) -> None:
    with closing(sqlite3.connect(path, timeout=_BUSY_S, isolation_level=None)) as database:
        (mode,) = database.execute("PRAGMA journal_mode = DELETE").fetchone()
    if mode != "delete" or log_of(path).exists():
        raise StorageError(f"{path}: in use by another process")
