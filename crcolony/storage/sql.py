"""Functions over sqlite3: rows that carry a digest, closing as a single file, and SQLite's errors as `StorageError`."""

import contextlib
import hashlib
import os
import sqlite3
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any
from urllib.parse import quote

import msgspec

from crcolony.errors import CrcolonyError

DIGEST_BYTES = 16
"""The size of a row's digest."""

_encode = msgspec.msgpack.Encoder().encode


class StorageError(CrcolonyError):
    """A robot's file cannot be used: the message names the file and the reason."""


def digest_of(table: str, columns: Mapping[str, Any]) -> bytes:
    """Return the digest of a row: over the table's name and all columns but the digest itself, in any order."""
    content = sorted((name, value) for name, value in columns.items() if name != "digest")
    return hashlib.blake2b(_encode((table, content)), digest_size=DIGEST_BYTES).digest()


def insert(database: sqlite3.Connection, table: str, columns: Mapping[str, Any]) -> bytes:
    """Insert a row and return its digest; raises sqlite3.IntegrityError if its key exists already."""
    return _insert(database, "INSERT", table, columns)


def insert_large(database: sqlite3.Connection, table: str, columns: Mapping[str, Any]) -> None:
    """Insert a row like `insert`, and keep no copy of its values in memory.

    Python keeps every statement for the next time, and a statement keeps the values that it had last: so it is given
    none, and inserts nothing.
    """
    row = {**columns, "digest": digest_of(table, columns)}
    marks = ", ".join("?" * len(row))
    statement = f"INSERT INTO {table} ({', '.join(row)}) SELECT {marks} WHERE ?"
    database.execute(statement, (*row.values(), True))
    database.execute(statement, (*[None] * len(row), False))


def insert_or_replace(
    database: sqlite3.Connection, table: str, columns: Mapping[str, Any]
) -> bytes:
    """Insert a row, replacing one of the same key, and return its digest."""
    return _insert(database, "INSERT OR REPLACE", table, columns)


def _insert(
    database: sqlite3.Connection, statement: str, table: str, columns: Mapping[str, Any]
) -> bytes:
    row = {**columns, "digest": digest_of(table, columns)}
    marks = ", ".join("?" * len(row))
    database.execute(
        f"{statement} INTO {table} ({', '.join(row)}) VALUES ({marks})", tuple(row.values())
    )
    digest: bytes = row["digest"]
    return digest


def update(
    database: sqlite3.Connection, table: str, before: Mapping[str, Any], columns: Mapping[str, Any]
) -> bytes:
    """Update the row with this `seq` and return its digest.

    Only columns that differ from `before` are written: SQLite then leaves the pages of the indices alone.
    """
    changed = {name: value for name, value in columns.items() if value != before[name]}
    changed["digest"] = digest_of(table, columns)
    sets = ", ".join(f"{name} = ?" for name in changed)
    database.execute(
        f"UPDATE {table} SET {sets} WHERE seq = ?", (*changed.values(), columns["seq"])
    )
    digest: bytes = changed["digest"]
    return digest


def select(
    database: sqlite3.Connection, query: str, *values: int | str | bytes
) -> Iterator[dict[str, Any]]:
    """Yield the rows of a query as dicts by column name."""
    cursor = database.execute(query, values)
    names = [column[0] for column in cursor.description]
    for row in cursor:
        yield dict(zip(names, row, strict=True))


def select_one(
    database: sqlite3.Connection, query: str, *values: int | str | bytes
) -> dict[str, Any] | None:
    """Return the first row of a query, or None if it has no rows."""
    return next(iter(list(select(database, query, *values))), None)


def connect_read_only(path: Path) -> sqlite3.Connection:
    """Open a database that is there, without any way to change it; raises sqlite3.Error."""
    return sqlite3.connect(f"file:{quote(os.fsencode(path.absolute()))}?mode=ro", uri=True)


def close_as_one_file(database: sqlite3.Connection) -> None:
    """Merge the write-ahead log into the main file and close, so that the one file can be copied and read anywhere.

    Where that is impossible (another process reads the database, or the disk is full) the log stays beside it, and
    nothing is lost.
    """
    with contextlib.suppress(sqlite3.Error):
        database.execute("PRAGMA journal_mode = DELETE")
    with contextlib.suppress(sqlite3.Error):
        database.close()


@contextlib.contextmanager
def storage_errors(path: Path) -> Iterator[None]:
    """Raise StorageError, naming the file, in place of every error of SQLite inside the block."""
    try:
        yield
    except sqlite3.Error as error:
        raise StorageError(f"{path}: {_format_error(error)}") from None
    except UnicodeDecodeError:  # the text of SQLite's error quotes the damaged bytes
        raise StorageError(f"{path}: corrupt") from None


def primary_code(error: Exception) -> int:
    """Return the primary result code of an error of SQLite, or -1 if the error is of another kind."""
    return getattr(error, "sqlite_errorcode", -1) & 0xFF


def _format_error(error: sqlite3.Error) -> str:
    match primary_code(error):
        case sqlite3.SQLITE_NOTADB:
            return "not a crcolony robot file"
        case sqlite3.SQLITE_BUSY:
            return "in use by another process"
        case sqlite3.SQLITE_FULL:
            return "cannot be written: the disk is full"
        case sqlite3.SQLITE_READONLY | sqlite3.SQLITE_PERM | sqlite3.SQLITE_CANTOPEN:
            return f"cannot be opened or written: {error}"
        case sqlite3.SQLITE_IOERR:
            return f"cannot be read or written: {error}"
        case _:
            return f"corrupt: {str(error).splitlines()[0]}"
