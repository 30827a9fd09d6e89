"""The table of a run is written and read exactly, and a crash leaves only whole rows."""

from pathlib import Path

import pytest

from crcolony.results.generation_table import (
    append_row,
    delete_rows_from,
    read_table,
    write_table,
)
from crcolony.storage.files import FolderError

ROWS = [{"generation": k, "matings": 0.1 * k} for k in range(4)]


def test_rows_that_are_appended_are_those_that_are_written(tmp_path: Path) -> None:
    """Byte for byte, and numbers are read back exactly."""
    one, other = tmp_path / "one.csv", tmp_path / "other.csv"
    write_table(one, ROWS)
    for row in ROWS:
        append_row(other, row)
    assert one.read_bytes() == other.read_bytes()
    assert [float(row["matings"]) for row in read_table(one)] == [row["matings"] for row in ROWS]


def test_a_table_keeps_the_columns_it_began_with(tmp_path: Path) -> None:
    """A column that a later version added is left out, wherever it stands among the others."""
    path, expected = tmp_path / "table.csv", tmp_path / "expected.csv"
    write_table(expected, ROWS)
    write_table(path, ROWS[:2])
    for row in ROWS[2:]:
        append_row(path, {"added": 7.0, **row})
    assert path.read_bytes() == expected.read_bytes()


def test_later_rows_and_a_row_cut_short_are_deleted(tmp_path: Path) -> None:
    """The others stay as they are."""
    path, expected = tmp_path / "table.csv", tmp_path / "expected.csv"
    write_table(path, ROWS)
    with path.open("a") as file:
        file.write("1")
    delete_rows_from(path, 2)
    write_table(expected, ROWS[:2])
    assert path.read_bytes() == expected.read_bytes()
    delete_rows_from(path, 0)
    assert path.read_bytes() == b""


def test_a_table_that_cannot_be_read_or_written_is_named(tmp_path: Path) -> None:
    """Missing, no text, without generations, or in a folder that does not exist."""
    binary, other = tmp_path / "binary", tmp_path / "other"
    binary.write_bytes(b"\xff\xfe\x00")
    other.write_text("name\none\n")
    for path in (tmp_path / "missing", binary):
        with pytest.raises(FolderError, match=f"{path}: cannot be read"):
            read_table(path)
    with pytest.raises(FolderError, match=f"{other}: corrupt: a row names no generation"):
        delete_rows_from(other, 1)
    with pytest.raises(FolderError, match="cannot be written"):
        write_table(tmp_path / "no" / "table.csv", ROWS)
