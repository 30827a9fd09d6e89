"""Copies a robot's file at one moment, whether the robot runs or not, and checks the copy."""

import os
import sqlite3
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from crcolony.storage.integrity import IntegrityReport, check_integrity
from crcolony.storage.schema import check_not_truncated, is_robot_file, names_in
from crcolony.storage.sql import StorageError, connect_read_only, storage_errors


@dataclass(frozen=True)
class CopiedRobot:
    """Whose file was copied, and of which moment."""

    id: str
    """32 hex digits"""
    incarnation: int
    encounters: int
    tick: int
    """Of its newest snapshot; 0 if it has none"""


def copy_robot_file(source: Path, target: Path) -> CopiedRobot:
    """Copy a robot's file into a new single file that is on the disk when this returns; raises StorageError.

    SQLite copies the pages of one moment and holds up no robot that writes meanwhile.
    """
    check_not_truncated(source)
    with storage_errors(target), closing(_create(target)) as database:
        with storage_errors(source), closing(connect_read_only(source)) as original:
            if not is_robot_file(original, source):
                raise StorageError(f"{source}: not a crcolony robot file: it is empty")
            with storage_errors(target):
                original.backup(database)
        database.execute("PRAGMA journal_mode = DELETE")  # one file, without a log beside it
        with storage_errors(source):
            copied = _describe(database, source)
    descriptor = os.open(target, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
    return copied


def check_robot_file(path: Path) -> CopiedRobot:
    """Check every page and row of a robot's file that nobody has open; raises StorageError."""
    with storage_errors(path), closing(connect_read_only(path)) as database:
        if not is_robot_file(database, path):
            raise StorageError(f"{path}: not a crcolony robot file: it is empty")
        return _describe(database, path)


def _create(target: Path) -> sqlite3.Connection:
    os.close(os.open(target, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600))
    return sqlite3.connect(target, isolation_level=None)


def _describe(database: sqlite3.Connection, path: Path) -> CopiedRobot:
    report: IntegrityReport = check_integrity(database, path, names_in(database, path))
    (encounters,) = database.execute("SELECT count(*) FROM encounters").fetchone()
    (tick,) = database.execute("SELECT ifnull(max(tick), 0) FROM snapshots").fetchone()
    return CopiedRobot(report.head.robot, report.head.incarnation, int(encounters), int(tick))
