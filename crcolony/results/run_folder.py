"""The results folder of an in-process run: config, versions, history, a table by generation, and a checkpoint.

    config.toml        the effective config
    run.json           versions, seed, how far the run is, its history hash
    history.sqlite     every birth (with its genes), mating, death, lifetime and turnover
    generations.csv    one row for each generation
    checkpoint.npz     the whole colony, from which the run is resumed

A generation is written in one transaction, and a file is replaced as a whole or not at all, so that the folder of a
run that was killed can be resumed.
"""

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
from crcolony.results.generation_table import GENERATION_TABLE, append_row, delete_rows_from
from crcolony.results.history_database import (
    HISTORY_DATABASE,
    create_tables,
    delete_events_after,
    insert_events,
)
from crcolony.storage.checkpoint import CheckpointError, read_checkpoint, write_checkpoint
from crcolony.storage.files import FolderError, lock_folder, replace_file
from crcolony.storage.sql import close_as_one_file

_PACKAGES = ("crcolony", "numpy", "numba", "pymunk", "msgspec")
"""Packages whose versions are recorded."""


class RunFolder:
    """Writes a run into its folder; raises FolderError when a file cannot be read or written."""

    def __init__(self, folder: Path, config: Config) -> None:
        self.folder = folder
        self.config = config
        self.hash = HistoryHash()
        self._events: list[Event] = []
        self._database: sqlite3.Connection | None = None
        self._lock: int | None = None

    def create(self, colony: dict[str, Any]) -> None:
        """Make the folder and write a first checkpoint.

        Raises FolderError, and leaves everything as it was, if the folder is not empty or cannot be written.
        """
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
        """Open a folder to resume its run; return it and the saved colony. What came after the checkpoint is deleted.

        Raises FolderError or ConfigError.
        """
        if not (folder / "config.toml").is_file():
            raise FolderError(f"{folder}: not a results folder: config.toml is missing")
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
            results._delete_after(tick, generation)
        except FolderError:
            results.close()
            raise
        return results, saved

    def add_event(self, event: Event) -> None:
        """Add an event to the history; it is written with its generation."""
        self.hash.add(event)
        self._events.append(event)

    def write_generation(self, row: Mapping[str, Any]) -> None:
        """Write the row of a generation that has ended, and the events since the last one; raises FolderError."""
        try:
            self._flush_events()
            append_row(self.folder / GENERATION_TABLE, row)
        except (OSError, sqlite3.Error) as error:
            raise FolderError(f"{self.folder}: cannot be written: {error}") from None

    def write_checkpoint(self, colony: dict[str, Any], generation: int, status: str) -> None:
        """Write a checkpoint of the colony and the run's progress, after all events before it; raises FolderError."""
        try:
            self._flush_events()
            self._connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
            replace_file(
                self.folder / "checkpoint.npz",
                lambda file: write_checkpoint(file, {**colony, "hash": str(self.hash)}),
            )
            description = self._format_run(generation, status)
            replace_file(self.folder / "run.json", lambda file: file.write(description))
        except (OSError, sqlite3.Error) as error:
            raise FolderError(f"{self.folder}: cannot be written: {error}") from None

    def close(self) -> None:
        """Close the database, as one file that can be copied and read anywhere, and release the folder."""
        if self._database is not None:
            close_as_one_file(self._database)
            self._database = None
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    @property
    def _connection(self) -> sqlite3.Connection:
        assert self._database is not None, "the folder is not open"
        return self._database

    def _format_run(self, generation: int, status: str) -> bytes:
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
        self._lock = lock_folder(self.folder)
        try:
            self._database = sqlite3.connect(self.folder / HISTORY_DATABASE)
            self._database.execute("PRAGMA journal_mode=WAL")
            self._database.execute("PRAGMA synchronous=NORMAL")
            create_tables(self._database)
            self._database.commit()
        except sqlite3.Error as error:
            raise FolderError(f"{self.folder / HISTORY_DATABASE}: {error}") from None

    def _flush_events(self) -> None:
        with self._connection as database:
            insert_events(database, self._events)
        self._events.clear()

    def _delete_after(self, tick: int, generation: int) -> None:
        """Delete events after this tick and rows of this and later generations."""
        try:
            with self._connection as database:
                delete_events_after(database, tick)
        except sqlite3.Error as error:
            raise FolderError(f"{self.folder}: cannot be resumed: {error}") from None
        table = self.folder / GENERATION_TABLE
        if table.exists():
            delete_rows_from(table, generation)


def keep_config(folder: Path, config: Config) -> None:
    """Write the config of a colony of processes into its folder, unless the folder has the same one already.

    Raises FolderError for a folder with another config, or with files of something else.
    """
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
