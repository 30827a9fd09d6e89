"""Rows are published as a typed table with a data dictionary, and read back as they were."""

import importlib.util
import json
import math
from pathlib import Path

import pytest

from crcolony.experiments.framework.experiment import Column, Row
from crcolony.experiments.framework.tidy_table import (
    check_needed_packages,
    checked_rows,
    read_rows,
    write_rows,
)
from crcolony.storage.files import FolderError

COLUMNS = {
    "length": Column("how long it is", "m"),
    "count": Column("how many there are"),
    "name": Column("what it is called"),
    "unused": Column("nothing"),
}


def test_rows_are_read_back_as_they_were(tmp_path: Path) -> None:
    """Numbers, words, what is missing; a column that no row has is not described."""
    rows: list[Row] = [
        {"condition": "a", "seed": 1, "length": 0.1, "count": 2},
        {"condition": "b", "seed": 2**62, "length": 3, "name": "ö"},
    ]
    write_rows(tmp_path, rows, COLUMNS)
    assert read_rows(tmp_path) == rows
    dictionary = json.loads((tmp_path / "data_dictionary.json").read_text("utf-8"))
    assert list(dictionary) == ["condition", "seed", "length", "count", "name"]
    assert dictionary["length"] == {"type": "double", "meaning": "how long it is", "unit": "m"}
    assert dictionary["count"]["type"] == "int64"


def test_a_number_that_does_not_exist_is_not_one_that_is_missing(tmp_path: Path) -> None:
    """NaN stays NaN."""
    write_rows(tmp_path, [{"condition": "a", "seed": 1, "length": math.nan}], COLUMNS)
    (row,) = read_rows(tmp_path)
    assert math.isnan(float(row["length"]))


def test_a_row_that_is_not_described_is_a_bug() -> None:
    """Of the experiment: a column without meaning, what is no plain number, or no row at all."""
    assert checked_rows({"count": 1}, COLUMNS) == [{"count": 1}]
    with pytest.raises(ValueError, match="a column 'size' that is not in the data dictionary"):
        checked_rows([{"count": 1}, {"size": 1}], COLUMNS)
    with pytest.raises(ValueError, match="neither int, float nor str"):
        checked_rows({"count": True}, COLUMNS)
    with pytest.raises(ValueError, match="no row"):
        checked_rows([], COLUMNS)


@pytest.mark.parametrize("content", [None, b"", b"PAR1 and nothing else"])
def test_a_table_that_cannot_be_read_is_named(tmp_path: Path, content: bytes | None) -> None:
    """Whether it is missing, empty or damaged."""
    if content is not None:
        (tmp_path / "rows.parquet").write_bytes(content)
    with pytest.raises(FolderError, match=r"rows\.parquet: (missing|cannot be read)"):
        read_rows(tmp_path)


def test_a_table_of_something_else_is_refused(tmp_path: Path) -> None:
    """It has no condition and no seed."""
    write_rows(tmp_path, [{"length": 1.0}], COLUMNS)
    with pytest.raises(FolderError, match="not rows with a condition and a seed"):
        read_rows(tmp_path)


def test_a_package_that_is_missing_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """With how to install it."""
    check_needed_packages()
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    monkeypatch.setattr("crcolony.experiments.framework.tidy_table.find_spec", lambda name: None)
    with pytest.raises(ImportError, match=r"pip install 'crcolony\[experiments\]'"):
        check_needed_packages()
