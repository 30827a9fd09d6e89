"""The rows of an experiment as a tidy table in Parquet, and what its columns mean.

One row is one observation, with its condition and seed; what it does not have is null, and a number that does not exist
is NaN.
"""

import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from crcolony.durable_files import replace_file
from crcolony.experiments.framework.experiment import CONDITION, SEED, Column, Row, Value
from crcolony.storage.files import FolderError

ROWS_FILE = "rows.parquet"
DICTIONARY_FILE = "data_dictionary.json"

_ALWAYS = {
    CONDITION: Column("what was run: the experiment's settings and methods by this name"),
    SEED: Column("seed of all random numbers of the run; conditions of one seed are pairs"),
}
_TYPES: dict[type, str] = {int: "int64", float: "double", str: "string"}


def check_needed_packages() -> None:
    """Raise ImportError unless everything is installed that experiments write and draw with."""
    for package in ("matplotlib", "pyarrow", "scipy"):
        if find_spec(package) is None:
            raise ImportError(f"experiments need {package}: pip install 'crcolony[experiments]'")


def checked_rows(result: Row | Sequence[Row], columns: Mapping[str, Column]) -> list[Row]:
    """Return the rows of a job; raises ValueError for one that the data dictionary does not describe."""
    rows = [result] if isinstance(result, dict) else list(result)
    if not rows:
        raise ValueError("a job gave no row")
    for row in rows:
        for name, value in row.items():
            if name not in columns:
                raise ValueError(f"a row has a column {name!r} that is not in the data dictionary")
            if type(value) not in _TYPES:
                raise ValueError(
                    f"{name} = {value!r}: neither int, float nor str, but {type(value)}"
                )
    return rows


def write_rows(folder: Path, rows: Sequence[Row], columns: Mapping[str, Column]) -> None:
    """Write the table and the data dictionary into a folder; raises OSError."""
    import pyarrow as pa  # type: ignore[import-untyped]
    from pyarrow import parquet

    described = _ALWAYS | dict(columns)
    used = [name for name in described if any(name in row for row in rows)]
    types = {name: _type_of(rows, name) for name in used}
    arrays = [pa.array([row.get(name) for row in rows], types[name]) for name in used]
    content = io.BytesIO()
    parquet.write_table(pa.table(arrays, names=used), content, compression="zstd")
    replace_file(folder / ROWS_FILE, lambda file: file.write(content.getvalue()))
    dictionary = {name: {"type": types[name], **asdict(described[name])} for name in used}
    text = json.dumps(dictionary, indent=2, ensure_ascii=False).encode()
    replace_file(folder / DICTIONARY_FILE, lambda file: file.write(text))


def _type_of(rows: Sequence[Row], name: str) -> str:
    """Return the type of a column: integers and other numbers in one column are floating-point numbers."""
    found = {type(row[name]) for row in rows if name in row}
    assert str not in found or found == {str}, f"{name}: both numbers and words"
    return _TYPES[found.pop() if len(found) == 1 else float]


def read_rows(folder: Path) -> list[Row]:
    """Read the table of a folder; raises FolderError if that is impossible."""
    import pyarrow as pa
    from pyarrow import parquet

    path = folder / ROWS_FILE
    try:
        table: list[dict[str, Value | None]] = parquet.read_table(path).to_pylist()
    except FileNotFoundError:
        raise FolderError(f"{path}: missing") from None
    except (OSError, pa.ArrowException) as error:
        raise FolderError(f"{path}: cannot be read: {_first_line(error)}") from None
    rows = [{name: value for name, value in row.items() if value is not None} for row in table]
    if not rows or not all({CONDITION, SEED} <= row.keys() for row in rows):
        raise FolderError(f"{path}: corrupt: not rows with a condition and a seed")
    return rows


def _first_line(error: Any) -> str:
    return str(error).splitlines()[0]
