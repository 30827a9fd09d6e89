"""The history of a run as a SQLite database: one table for each kind of event."""

import contextlib
import sqlite3
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import msgspec

from crcolony.evolution.history import Born, Died, Event, Lived, Mated, TurnedOver
from crcolony.storage.files import FolderError
from crcolony.storage.sql import connect_read_only

HISTORY_DATABASE = "history.sqlite"
"""The database's name in a results folder."""

TABLES = {
    Born: "births",
    Mated: "matings",
    Died: "deaths",
    Lived: "lives",
    TurnedOver: "turnovers",
}
"""The table of each kind of event; its columns are the event's fields."""

_SQL_TYPES = {int: "INTEGER", float: "REAL", bool: "INTEGER", bytes: "BLOB"}


def write_history(path: Path, events: Sequence[Event]) -> None:
    """Write a complete history into a new database, which replaces an older one; raises FolderError."""
    draft = path.with_name(path.name + ".part")
    draft.unlink(missing_ok=True)
    try:
        with contextlib.closing(sqlite3.connect(draft)) as database, database:
            create_tables(database)
            insert_events(database, events)
        draft.replace(path)
    except (OSError, sqlite3.Error) as error:
        raise FolderError(f"{path}: cannot be written: {error}") from None


def create_tables(database: sqlite3.Connection) -> None:
    """Create the tables that are missing."""
    for kind, table in TABLES.items():
        columns = ", ".join(_columns(kind))
        database.execute(f"CREATE TABLE IF NOT EXISTS {table} ({columns})")


def insert_events(database: sqlite3.Connection, events: Sequence[Event]) -> None:
    """Insert events, each into the table of its kind."""
    for kind, table in TABLES.items():
        rows = [msgspec.structs.astuple(event) for event in events if type(event) is kind]
        marks = ", ".join("?" * len(kind.__struct_fields__))
        database.executemany(f"INSERT INTO {table} VALUES ({marks})", rows)


def delete_events_after(database: sqlite3.Connection, tick: int) -> None:
    """Delete the events of all later ticks."""
    for table in TABLES.values():
        database.execute(f"DELETE FROM {table} WHERE tick > ?", (tick,))


def check_history(path: Path, tick: int, expected: int | None) -> int:
    """Return the number of events of a history up to a tick; None: it is not known how many there must be.

    Raises FolderError if the database is damaged, or if there are more or fewer.
    """
    try:
        with contextlib.closing(connect_read_only(path)) as database:
            (finding,) = database.execute("PRAGMA quick_check(1)").fetchone()
            counts = [
                int(
                    database.execute(
                        f"SELECT count(*) FROM {table} WHERE tick <= {tick}"
                    ).fetchone()[0]
                )
                for table in TABLES.values()
            ]
    except sqlite3.Error as error:
        raise FolderError(f"{path}: corrupt: {error}") from None
    if finding != "ok":
        raise FolderError(f"{path}: corrupt: {finding.splitlines()[0]}")
    if expected is not None and sum(counts) != expected:
        raise FolderError(
            f"{path}: corrupt, or checkpoint.npz is that of another run: there are {sum(counts)} events"
            f" up to the checkpoint, not {expected}"
        )
    return sum(counts)


def read_births(path: Path) -> list[Born]:
    """Return all births of a history in their order, also while the run goes on; raises FolderError."""
    if not path.is_file():
        raise FolderError(f"{path}: missing")
    try:
        with contextlib.closing(connect_read_only(path)) as database:
            rows = database.execute("SELECT * FROM births ORDER BY rowid").fetchall()
        return [msgspec.convert(("Born", *row), Born, strict=False) for row in rows]
    except (sqlite3.Error, msgspec.ValidationError) as error:
        raise FolderError(f"{path}: cannot be read: {error}") from None


def _columns(kind: Any) -> Iterable[str]:
    for field in msgspec.structs.fields(kind):
        yield f"{field.name} {_SQL_TYPES.get(field.type, 'TEXT')}"
