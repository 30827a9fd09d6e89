"""The results folder of an in-process run: config, versions, history, a table by generation, and a checkpoint.

    made_by.toml       what made the folder, and from which earlier run
    config.toml        the effective config
    founders.npz       what its robots began with, if that was an earlier run
    run.json           versions, seed, how far the run is, its history hash
    history.sqlite     every birth (with its genes), mating, death, lifetime and turnover
    generations.csv    one row for each generation
    checkpoint.npz     the whole colony, from which the run is resumed

A generation is written in one transaction, and a file is replaced as a whole or not at all, so that the folder of a
run that was killed can be resumed.
"""

import json
import platform
import sqlite3
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from crcolony.config import CONFIG_FILE, Config, load, to_toml
from crcolony.durable_files import replace_file
from crcolony.evolution.history import Event, HistoryHash
from crcolony.results.generation_table import GENERATION_TABLE, append_row, delete_rows_from
from crcolony.results.history_database import (
    HISTORY_DATABASE,
    check_history,
    create_tables,
    delete_events_after,
    insert_events,
)
from crcolony.storage.checkpoint import CheckpointError, read_checkpoint, write_checkpoint
from crcolony.storage.claimed_folder import ClaimedFolder, claim_folder, existing_run_advice
from crcolony.storage.files import FolderError
from crcolony.storage.folder_record import check_config_digest, read_record
from crcolony.storage.founders_file import Beginning, read_founders
from crcolony.storage.sql import close_as_one_file

CHECKPOINT_FILE = "checkpoint.npz"
"""The name of the checkpoint of the whole colony."""
RUN_FILE = "run.json"
"""The name of the description of the run."""
_PACKAGES = ("crcolony", "numpy", "numba", "pymunk", "msgspec")
"""Packages whose versions are recorded."""


class RunFolder:
    """Writes a run into its folder; raises FolderError when a file cannot be read or written."""

    def __init__(self, claimed: ClaimedFolder, config: Config) -> None:
        self.folder = claimed.path
        self.config = config
        self.hash = HistoryHash()
        self._claimed = claimed
        self._events: list[Event] = []
        self._written = 0
        """Events in the database"""
        self._database: sqlite3.Connection | None = None

    @classmethod
    def claim(cls, folder: Path | None, config: Config) -> "RunFolder":
        """Make a folder for a new run, or the next free runs/N; raises FolderError for one that is not empty."""
        claimed = claim_folder(folder, "evolve")
        if not claimed.is_new:
            claimed.close()
            raise FolderError(f"{claimed.path}: {existing_run_advice(claimed.path)}")
        return cls(claimed, config)

    def create(self, colony: dict[str, Any], beginning: Beginning | None = None) -> None:
        """Write the first files and a first checkpoint; raises FolderError."""
        self._claimed.begin(to_toml(self.config), beginning)
        self._open()
        create_tables(self._connection)
        self.write_checkpoint(colony, 0, "running")

    def discard(self) -> None:
        """Close and delete a folder whose run could not be started, and leave all as it was before."""
        self._close_database()
        self._claimed.discard()

    @classmethod
    def resume(
        cls, folder: Path, generations: int | None = None
    ) -> tuple["RunFolder", dict[str, Any]]:
        """Open a folder to resume its run; return it and the saved colony. What came after the checkpoint is deleted.

        With `generations` the run has that many from now on. Nothing is changed before all files are found to be
        there and to fit each other. Raises FolderError or ConfigError.
        """
        if not (folder / CONFIG_FILE).is_file() and read_record(folder) is None:
            raise FolderError(f"{folder}: not a results folder: {CONFIG_FILE} is missing")
        claimed = claim_folder(folder, "evolve")
        try:
            results, saved = cls._read(claimed, generations)
            results._open()
            results._delete_after(int(saved["tick"]), int(saved["generation"]))
            if generations is not None:
                claimed.write_config(to_toml(results.config))
        except BaseException:
            claimed.close()
            raise
        return results, saved

    @classmethod
    def _read(
        cls, claimed: ClaimedFolder, generations: int | None
    ) -> tuple["RunFolder", dict[str, Any]]:
        """Read the config and the checkpoint of a folder, and check that its other files are there."""
        folder = claimed.path
        check_config_digest(folder)
        settings = [] if generations is None else [f"generations={generations}"]
        results = cls(claimed, load(folder / CONFIG_FILE, settings))
        record, path = read_record(folder), folder / CHECKPOINT_FILE
        if record is not None and record.origin is not None:
            read_founders(folder)
        try:
            saved = read_checkpoint(path)
            results.hash = HistoryHash(bytes.fromhex(saved["hash"]))
            ended = int(saved["generation"])
            int(saved["tick"])
        except FileNotFoundError:
            raise FolderError(f"{path}: missing; without it the run cannot go on") from None
        except (CheckpointError, KeyError, TypeError, ValueError) as error:
            raise FolderError(f"{path}: corrupt: {error}") from None
        if 0 < results.config.generations < ended:
            raise FolderError(f"{folder}: has ended {ended} generations already")
        for name in (HISTORY_DATABASE, RUN_FILE, *([GENERATION_TABLE] if ended else [])):
            if not (folder / name).is_file():
                raise FolderError(f"{folder / name}: missing; without it the run cannot go on")
        results._written = check_history(
            folder / HISTORY_DATABASE, int(saved["tick"]), saved.get("events")
        )
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
                self.folder / CHECKPOINT_FILE,
                lambda file: write_checkpoint(
                    file, {**colony, "hash": str(self.hash), "events": self._written}
                ),
            )
            description = self._format_run(generation, status)
            replace_file(self.folder / RUN_FILE, lambda file: file.write(description))
        except (OSError, sqlite3.Error) as error:
            raise FolderError(f"{self.folder}: cannot be written: {error}") from None

    def close(self) -> None:
        """Close the database, as one file that can be copied and read anywhere, and release the folder."""
        self._close_database()
        self._claimed.close()

    def _close_database(self) -> None:
        if self._database is not None:
            close_as_one_file(self._database)
            self._database = None

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
        try:
            self._database = sqlite3.connect(self.folder / HISTORY_DATABASE)
            self._database.execute("PRAGMA journal_mode=WAL")
            self._database.execute("PRAGMA synchronous=NORMAL")
        except sqlite3.Error as error:
            raise FolderError(f"{self.folder / HISTORY_DATABASE}: {error}") from None

    def _flush_events(self) -> None:
        with self._connection as database:
            insert_events(database, self._events)
        self._written += len(self._events)
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


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
