"""Parquet files are written all at once or not at all, in bounded memory."""

from pathlib import Path

import pyarrow.parquet as pq  # type: ignore[import-untyped]
import pytest

from crcolony.recordings import parquet
from crcolony.recordings.parquet import table_files

TABLES = {"a": {"x": "int64", "name": "string"}, "b": {"genes": "list<double>"}}


def test_rows_are_read_as_they_were_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In order, over several groups, with null where there is no value."""
    monkeypatch.setattr(parquet, "_GROUP_ROWS", 10)
    rows = [(k, f"name {k}" if k % 3 else None) for k in range(25)]
    with table_files(tmp_path / "out", TABLES) as files:
        files["a"].add_all(rows)
        files["b"].add(([1.0, 2.0],))
        files["b"].add((None,))
    table = pq.ParquetFile(tmp_path / "out" / "a.parquet")
    assert table.num_row_groups == 3
    assert table.read().to_pylist() == [{"x": x, "name": name} for x, name in rows]
    genes = pq.read_table(tmp_path / "out" / "b.parquet").to_pylist()
    assert genes == [{"genes": [1.0, 2.0]}, {"genes": None}]
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["a.parquet", "b.parquet"]


def write_and_interrupt(folder: Path) -> None:
    with table_files(folder, TABLES) as files:
        files["a"].add((2, "second"))
        raise KeyboardInterrupt


def test_an_exception_leaves_the_folder_as_it_was(tmp_path: Path) -> None:
    """A new folder is removed; in an old one the files of before stay."""
    for folder in (tmp_path / "new", tmp_path / "old"):
        before = {}
        if folder.name == "old":
            with table_files(folder, TABLES) as files:
                files["a"].add((1, "first"))
            before = {path: path.read_bytes() for path in folder.iterdir()}
        with pytest.raises(KeyboardInterrupt):
            write_and_interrupt(folder)
        assert folder.exists() == bool(before)
        after = {path: path.read_bytes() for path in folder.iterdir()} if before else {}
        assert after == before


def test_integers_beyond_64_bits_become_null(tmp_path: Path) -> None:
    """The rest of the column is there."""
    with table_files(tmp_path, TABLES) as files:
        files["a"].add_all([(2**64, "huge"), (9, "good"), (-(2**63), "least")])
    rows = pq.read_table(tmp_path / "a.parquet").to_pylist()
    assert [row["x"] for row in rows] == [None, 9, -(2**63)]


def test_a_folder_that_cannot_be_written_is_an_error(tmp_path: Path) -> None:
    """Here it is a file."""
    (tmp_path / "out").touch()
    with pytest.raises(OSError), table_files(tmp_path / "out", TABLES):
        pass
