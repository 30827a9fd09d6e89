"""The results folder of an embedded run: config, versions, history, a table by generation, and a checkpoint.

    config.toml        the effective config
    run.json           versions, seed, how far the run is, its history hash
    history.sqlite     every birth (with its genes), mating, death, life and turnover
    generations.csv    one row a generation
    checkpoint.npz     the whole colony, to go on from

A generation is written in one transaction, and a file is replaced whole or not at all, so that a run that is killed
leaves a folder that can be resumed.
"""

import contextlib
import fcntl
import json
import os
import platform
import shutil
import sqlite3
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from crcolony.config import Config, load, to_toml
from crcolony.evolution.history import Event, HistoryHash
from crcolony.results.generation_table import _append, _as_csv, read_table
from crcolony.results.history_database import TABLES, _insert, _make_tables
from crcolony.storage.checkpoint import CheckpointError, read_checkpoint, write_checkpoint
from crcolony.storage.files import FolderError, replace_file

_PACKAGES = ("crcolony", "numpy", "numba", "pymunk", "msgspec")


class RunFolder:
    """Writes a run into its folder; raises FolderError when the outside (disk, files) refuses."""

    def __init__(self, folder: Path, config: Config) -> None:
        self.folder = folder
        self.config = config
        self.hash = HistoryHash()
        self._events: list[Event] = []
        self._database: sqlite3.Connection | None = None
        self._lock: int | None = None

    def create(self, colony: dict[str, Any]) -> None:
        """Make the folder, with a first checkpoint; if it is not empty or cannot be written, leave it as it was."""
        is_new = not self.folder.exists()
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            is_empty = not any(self.folder.iterdir())
        except OSError as error:
            raise FolderError(f"{self.folder}: cannot be written: {error.strerror}") from None
        if not is_empty:
            raise FolderError(f"{self.folder}: not empty; choose another --out or use --resume")
        try:
            config = to_toml(self.config).encode()
            replace_file(self.folder / "config.toml", lambda file: file.write(config))
            self._open()
            self.write_checkpoint(colony, 0, "running")
        except BaseException as error:  # Ctrl-C too
            self.close()
            shutil.rmtree(self.folder)
            if not is_new:
                self.folder.mkdir()
            if isinstance(error, OSError):
                raise FolderError(f"{self.folder}: cannot be written: {error.strerror}") from None
            raise

    @classmethod
    def resume(cls, folder: Path) -> tuple["RunFolder", dict[str, Any]]:
        """Open a folder to go on; return it and the saved colony. What came after the checkpoint is forgotten."""
        if not (folder / "config.toml").is_file():
            raise FolderError(f"{folder}: no results folder: config.toml is missing")
        results = cls(folder, load(folder / "config.toml"))
        path = folder / "checkpoint.npz"
        try:
            saved = read_checkpoint(path)
            results.hash = HistoryHash(bytes.fromhex(saved["hash"]))
            tick, generation = int(saved["tick"]), int(saved["generation"])
        except FileNotFoundError:
            raise FolderError(f"{path}: missing; the run wrote no checkpoint") from None
        except (CheckpointError, KeyError, TypeError, ValueError) as error:
            raise FolderError(f"{path}: corrupt: {error}") from None
        try:
            results._open()
            results._forget_after(tick, generation)
        except FolderError:
            results.close()
            raise
        return results, saved

    def add_event(self, event: Event) -> None:
        """Take one event of the history."""
        self.hash.add(event)
        self._events.append(event)

    def write_generation(self, row: Mapping[str, Any]) -> None:
        """Write a finished generation: its row of the table, and the events since the last."""
        try:
            self._flush()
            _append(self.folder / "generations.csv", row)
        except (OSError, sqlite3.Error) as error:
            raise FolderError(f"{self.folder}: cannot be written: {error}") from None

    def write_checkpoint(self, colony: dict[str, Any], generation: int, status: str) -> None:
        """Save the whole colony and say how far the run is; what it builds on is on the disk before it."""
        try:
            self._flush()
            self._connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
            replace_file(
                self.folder / "checkpoint.npz",
                lambda file: write_checkpoint(file, {**colony, "hash": str(self.hash)}),
            )
            description = self._describe(generation, status)
            replace_file(self.folder / "run.json", lambda file: file.write(description))
        except (OSError, sqlite3.Error) as error:
            raise FolderError(f"{self.folder}: cannot be written: {error}") from None

    def close(self) -> None:
        """Let the database go, as one file that can be copied and read anywhere."""
        if self._database is not None:
            with contextlib.suppress(
                sqlite3.Error
            ):  # on a full disk it stays two files, and as good
                self._database.execute("PRAGMA journal_mode=DELETE")
            self._database.close()
            self._database = None
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    @property
    def _connection(self) -> sqlite3.Connection:
        assert self._database is not None, "the folder is not open"
        return self._database

    def _describe(self, generation: int, status: str) -> bytes:
        return json.dumps(
            {
                "status": status,
                "generations": generation,
                "seed": self.config.seed,
                "history_hash": str(self.hash),
                "python": platform.python_version(),
                "versions": {name: _version(name) for name in _PACKAGES},
            },
            indent=2,
        ).encode()

    def _open(self) -> None:
        self._lock = os.open(self.folder, os.O_RDONLY)
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise FolderError(f"{self.folder}: in use by another run") from None
        try:
            self._database = sqlite3.connect(self.folder / "history.sqlite")
            self._database.execute("PRAGMA journal_mode=WAL")
            self._database.execute("PRAGMA synchronous=NORMAL")
            _make_tables(self._database)
            self._database.commit()
        except sqlite3.Error as error:
            raise FolderError(f"{self.folder / 'history.sqlite'}: {error}") from None

    def _flush(self) -> None:
        with self._connection as database:
            _insert(database, self._events)
        self._events.clear()

    def _forget_after(self, tick: int, generation: int) -> None:
        path = self.folder / "generations.csv"
        try:
            with self._connection as database:
                for table in TABLES.values():
                    database.execute(f"DELETE FROM {table} WHERE tick > ?", (tick,))
            if path.exists():
                rows = read_table(path)
                whole = [row for row in rows if None not in row.values()]
                kept = [row for row in whole if int(row["generation"]) < generation]
                replace_file(path, lambda file: file.write(_as_csv(kept)))
        except (KeyError, ValueError):
            raise FolderError(f"{path}: corrupt: a row names no generation") from None
        except (OSError, sqlite3.Error) as error:
            raise FolderError(f"{self.folder}: cannot be resumed: {error}") from None


def keep_config(folder: Path, config: Config) -> None:
    """Write the config of a colony of processes into its folder; raises FolderError if it has another already."""
    settings = folder / "config.toml"
    if settings.exists():
        if load(settings) != config:
            raise FolderError(f"{folder}: holds a colony of other settings; see its config.toml")
        return
    if any(folder.iterdir()):
        raise FolderError(f"{folder}: not empty; choose another --out")
    content = to_toml(config).encode()
    try:
        replace_file(settings, lambda file: file.write(content))
    except OSError as error:
        raise FolderError(f"{settings}: cannot be written: {error.strerror}") from None


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
