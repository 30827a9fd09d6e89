"""The table of a run with one row for every generation, as a CSV file."""

import csv
import io
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from crcolony.storage.files import FolderError, replace_file


def write_table(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write a table by generation; raises FolderError."""
    try:
        replace_file(path, lambda file: file.write(_as_csv(rows)))
    except OSError as error:
        raise FolderError(f"{path}: cannot be written: {error.strerror}") from None


def read_table(path: Path) -> list[dict[str, str]]:
    """Read a table by generation; raises FolderError if it cannot be read."""
    try:
        with path.open(newline="", encoding="utf-8") as file:
            return list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise FolderError(f"{path}: cannot be read: {error}") from None


def _as_csv(rows: Sequence[Mapping[str, Any]]) -> bytes:
    if not rows:
        return b""
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, fieldnames=list(rows[0]))
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue().encode()


def _append(path: Path, row: Mapping[str, Any]) -> None:
    """Add a row to a table, whole or not at all."""
    size = path.stat().st_size if path.exists() else 0
    try:
        with path.open("a", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, fieldnames=list(row))
            if size == 0:
                writer.writeheader()
            writer.writerow(row)
    except OSError:
        os.truncate(path, size)
        raise
