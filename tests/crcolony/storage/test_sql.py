"""Rows carry digests, databases close as one file, and errors of SQLite name the file."""

import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from crcolony.storage.sql import (
    StorageError,
    close_as_one_file,
    digest_of,
    insert,
    insert_large,
    insert_or_replace,
    select,
    select_one,
    storage_errors,
    update,
)


@pytest.fixture
def database() -> Iterator[sqlite3.Connection]:
    """Return a database with one table."""
    with closing(sqlite3.connect(":memory:")) as database:
        database.execute("CREATE TABLE rows (seq INTEGER PRIMARY KEY, name TEXT, digest BLOB)")
        yield database


def test_a_digest_depends_on_table_columns_and_values_alone() -> None:
    """Not on the order of columns, nor on a digest among them."""
    row = {"a": 1, "b": b"x"}
    assert digest_of("t", row) == digest_of("t", {"b": b"x", "digest": b"any", "a": 1})
    others = ("u", row), ("t", {"a": 2, "b": b"x"}), ("t", {"c": 1, "b": b"x"}), ("t", {"a": 1})
    assert len({digest_of("t", row), *(digest_of(*other) for other in others)}) == 5


def test_rows_are_inserted_replaced_and_updated_with_their_digests(
    database: sqlite3.Connection,
) -> None:
    """Inserting one of the same key is an error."""
    row = {"seq": 1, "name": "one"}
    assert insert(database, "rows", row) == digest_of("rows", row)
    with pytest.raises(sqlite3.IntegrityError):
        insert(database, "rows", row)
    for change in (insert_or_replace(database, "rows", row | {"name": "two"}),):
        assert select_one(database, "SELECT * FROM rows") == {
            "seq": 1,
            "name": "two",
            "digest": change,
        }
    digest = update(database, "rows", row | {"name": "two"}, row)
    assert list(select(database, "SELECT * FROM rows")) == [row | {"digest": digest}]
    assert digest == digest_of("rows", row)
    assert select_one(database, "SELECT * FROM rows WHERE seq = ?", 2) is None


def test_a_large_row_is_inserted_once_like_any_other(database: sqlite3.Connection) -> None:
    """One of the same key is an error here, too."""
    row = {"seq": 1, "name": "long"}
    insert_large(database, "rows", row)
    assert list(select(database, "SELECT * FROM rows")) == [
        row | {"digest": digest_of("rows", row)}
    ]
    with pytest.raises(sqlite3.IntegrityError):
        insert_large(database, "rows", row)


def test_a_closed_database_is_one_file(tmp_path: Path) -> None:
    """Its log is merged, so that the file can be copied alone."""
    path = tmp_path / "file.sqlite"
    database = sqlite3.connect(path, isolation_level=None)
    database.execute("PRAGMA journal_mode = WAL")
    database.execute("CREATE TABLE rows (seq INTEGER)")
    assert len(list(tmp_path.iterdir())) > 1
    close_as_one_file(database)
    assert [file.name for file in tmp_path.iterdir()] == ["file.sqlite"]
    with pytest.raises(sqlite3.ProgrammingError):
        database.execute("SELECT 1")


def test_a_database_that_is_being_read_closes_all_the_same(tmp_path: Path) -> None:
    """Its log stays beside it, and nothing is lost."""
    path = tmp_path / "file.sqlite"
    database = sqlite3.connect(path, isolation_level=None, timeout=0.01)
    database.execute("PRAGMA journal_mode = WAL")
    database.execute("CREATE TABLE rows (seq INTEGER)")
    with closing(sqlite3.connect(path)) as reader:
        assert reader.execute("SELECT count(*) FROM rows").fetchone() == (0,)
        database.execute("INSERT INTO rows VALUES (1)")
        close_as_one_file(database)
        assert reader.execute("SELECT count(*) FROM rows").fetchone() == (1,)


@pytest.mark.parametrize(
    ("code", "message"),
    [
        (sqlite3.SQLITE_NOTADB, "not a crcolony robot file"),
        (sqlite3.SQLITE_BUSY, "in use by another process"),
        (sqlite3.SQLITE_FULL, "cannot be written: the disk is full"),
        (sqlite3.SQLITE_CANTOPEN, "cannot be opened or written: what SQLite says"),
        (sqlite3.SQLITE_IOERR_WRITE, "cannot be read or written: what SQLite says"),
        (sqlite3.SQLITE_CORRUPT, "corrupt: what SQLite says"),
    ],
)
def test_an_error_of_sqlite_becomes_one_line(code: int, message: str) -> None:
    """It names the file and the reason."""
    error = sqlite3.OperationalError("what SQLite says")
    error.sqlite_errorcode = code
    with pytest.raises(StorageError) as raised, storage_errors(Path("file")):
        raise error
    assert str(raised.value) == f"file: {message}"
