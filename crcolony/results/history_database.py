"""The history of a run as a SQLite database: one table for every kind of event."""

import contextlib
import sqlite3
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import msgspec

from crcolony.evolution.history import Born, Died, Event, Lived, Mated, TurnedOver
from crcolony.storage.files import FolderError

TABLES = {
    Born: "births",
    Mated: "matings",
    Died: "deaths",
    Lived: "lives",
    TurnedOver: "turnovers",
}

_SQL_TYPES = {int: "INTEGER", float: "REAL", bool: "INTEGER", bytes: "BLOB"}


def write_history(path: Path, events: Sequence[Event]) -> None:
    """Write a history that is complete into a database of its own, as that of a run; raises FolderError."""
    draft = path.with_name(path.name + ".part")
    draft.unlink(missing_ok=True)
    try:
        with contextlib.closing(sqlite3.connect(draft)) as database, database:
            _make_tables(database)
            _insert(database, events)
        draft.replace(path)
    except (OSError, sqlite3.Error) as error:
        raise FolderError(f"{path}: cannot be written: {error}") from None


def _make_tables(database: sqlite3.Connection) -> None:
    for kind, table in TABLES.items():
        columns = ", ".join(_columns(kind))
        database.execute(f"CREATE TABLE IF NOT EXISTS {table} ({columns})")


def _insert(database: sqlite3.Connection, events: Sequence[Event]) -> None:
    for kind, table in TABLES.items():
        rows = [msgspec.structs.astuple(event) for event in events if type(event) is kind]
        marks = ", ".join("?" * len(kind.__struct_fields__))
        database.executemany(f"INSERT INTO {table} VALUES ({marks})", rows)


def _columns(kind: Any) -> Iterable[str]:
    for field in msgspec.structs.fields(kind):
        yield f"{field.name} {_SQL_TYPES.get(field.type, 'TEXT')}"
