"""Small helpers over sqlite3: rows with digests, and SQLite's errors as ours."""

import contextlib
import hashlib
import sqlite3
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import msgspec

from crcolony.errors import CrcolonyError

_DIGEST_BYTES = 16

_encode = msgspec.msgpack.Encoder().encode


class StorageError(CrcolonyError):
    """A memory cannot be used: the message names the file and the reason."""


def digest_of(table: str, columns: Mapping[str, Any]) -> bytes:
    """Return the digest of a row: over all its columns but the digest, whatever their order."""
    content = sorted((name, value) for name, value in columns.items() if name != "digest")
    return hashlib.blake2b(_encode((table, content)), digest_size=_DIGEST_BYTES).digest()


def put(database: sqlite3.Connection, table: str, columns: Mapping[str, Any]) -> bytes:
    """Write a row, in place of one with the same key; return its digest."""
    return _insert(database, "INSERT OR REPLACE", table, columns)


def insert(database: sqlite3.Connection, table: str, columns: Mapping[str, Any]) -> bytes:
    """Write a new row; return its digest. Raises sqlite3.IntegrityError if there is one of the same key."""
    return _insert(database, "INSERT", table, columns)


def _insert(
    database: sqlite3.Connection, how: str, table: str, columns: Mapping[str, Any]
) -> bytes:
    row = {**columns, "digest": digest_of(table, columns)}
    marks = ", ".join("?" * len(row))
    database.execute(f"{how} INTO {table} ({', '.join(row)}) VALUES ({marks})", tuple(row.values()))
    digest: bytes = row["digest"]
    return digest


def update(
    database: sqlite3.Connection, table: str, before: Mapping[str, Any], columns: Mapping[str, Any]
) -> bytes:
    """Change a row, found by its `seq`, where it differs from what it was; return its digest.

    What does not change is not written: SQLite then leaves the pages of the indices alone.
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
    """Yield rows as dicts by column."""
    cursor = database.execute(query, values)
    names = [column[0] for column in cursor.description]
    for row in cursor:
        yield dict(zip(names, row, strict=True))


def find(
    database: sqlite3.Connection, query: str, *values: int | str | bytes
) -> dict[str, Any] | None:
    """Return the one row there is, if there is one."""
    rows = list(select(database, query, *values))
    return rows[0] if rows else None


@contextlib.contextmanager
def named_errors(path: Path) -> Iterator[None]:
    """Turn whatever SQLite raises about a file into a StorageError."""
    try:
        yield
    except sqlite3.Error as error:
        raise StorageError(f"{path}: {_reason(error)}") from None
    except UnicodeDecodeError:  # of an error's text that quotes the damage
        raise StorageError(f"{path}: corrupt") from None


def primary_code(error: Exception) -> int:
    """Return which kind of error SQLite met, or -1 if the error is not SQLite's own."""
    return getattr(error, "sqlite_errorcode", -1) & 0xFF


def _reason(error: sqlite3.Error) -> str:
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
