"""The table of a run, with one row for each generation, as a CSV file."""

import csv
import io
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from crcolony.durable_files import replace_file
from crcolony.storage.files import FolderError

GENERATION_TABLE = "generations.csv"
"""The table's name in a results folder."""
LAST_GENERATIONS = 10
"""The end of a run is the mean over so many last generations."""


def write_table(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write a table as a whole or not at all; raises FolderError."""
    try:
        replace_file(path, lambda file: file.write(_format_csv(rows)))
    except OSError as error:
        raise FolderError(f"{path}: cannot be written: {error.strerror}") from None


def read_table(path: Path) -> list[dict[str, str]]:
    """Read a table; raises FolderError if it cannot be read."""
    try:
        with path.open(newline="", encoding="utf-8") as file:
            return list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise FolderError(f"{path}: cannot be read: {error}") from None


def append_row(path: Path, row: Mapping[str, Any]) -> None:
    """Append a row to a table, as a whole or not at all; raises OSError.

    A table keeps the columns with which it began: what an earlier version wrote is not mixed with other columns.
    """
    size = path.stat().st_size if path.exists() else 0
    columns = _columns(path) if size else list(row)
    try:
        with path.open("a", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, fieldnames=columns, extrasaction="ignore")
            if size == 0:
                writer.writeheader()
            writer.writerow(row)
    except OSError:
        os.truncate(path, size)
        raise


def _columns(path: Path) -> list[str]:
    with path.open(newline="", encoding="utf-8") as file:
        return next(csv.reader(file))


def delete_rows_from(path: Path, generation: int) -> None:
    """Delete the rows of this and later generations, and a last row that a crash cut short; raises FolderError."""
    rows = read_table(path)
    whole = [row for row in rows if None not in row.values()]
    try:
        kept = [row for row in whole if int(row["generation"]) < generation]
    except (KeyError, ValueError):
        raise FolderError(f"{path}: corrupt: a row names no generation") from None
    write_table(path, kept)


def _format_csv(rows: Sequence[Mapping[str, Any]]) -> bytes:
    if not rows:
        return b""
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, fieldnames=list(rows[0]))
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue().encode()
