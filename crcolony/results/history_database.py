"""The history of a run as a SQLite database: one table for each kind of event."""

import contextlib
import sqlite3
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import msgspec

from crcolony.evolution.history import Born, Died, Event, Lived, Mated, TurnedOver
from crcolony.storage.files import FolderError

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


def _columns(kind: Any) -> Iterable[str]:
    for field in msgspec.structs.fields(kind):
        yield f"{field.name} {_SQL_TYPES.get(field.type, 'TEXT')}"
