"""Parquet files that are written row by row with bounded memory, all of them or none."""

import contextlib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any

from crcolony.recordings.tables import Columns, Row

_GROUP_ROWS = 20_000
"""Rows of a table that are kept in memory before they are written."""
_INTEGERS = range(-(2**63), 2**63)
"""The values of a column of integers."""
_DRAFT = ".part"
"""Suffix of a file that is not complete."""


@contextlib.contextmanager
def table_files(folder: Path, tables: Mapping[str, Columns]) -> Iterator[dict[str, "TableFile"]]:
    """Write files `NAME.parquet` of some tables into a folder; after an exception the folder is as it was before.

    Raises OSError if a file cannot be written.
    """
    is_new = not folder.exists()
    drafts = {name: folder / f"{name}.parquet{_DRAFT}" for name in tables}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with contextlib.ExitStack() as opened:
            yield {
                name: opened.enter_context(TableFile(draft, tables[name]))
                for name, draft in drafts.items()
            }
        for draft in drafts.values():
            draft.replace(draft.with_suffix(""))
    except BaseException:  # Ctrl-C too
        with contextlib.suppress(OSError):
            for draft in drafts.values():
                draft.unlink(missing_ok=True)
            if is_new:
                folder.rmdir()
        raise


class TableFile:
    """One Parquet file that is being written."""

    def __init__(self, path: Path, columns: Columns) -> None:
        import pyarrow as pa  # type: ignore[import-untyped]
        from pyarrow.parquet import ParquetWriter  # type: ignore[import-untyped]

        floats = pa.list_(pa.float64())
        self._schema = pa.schema(
            [(name, floats if kind == "list<double>" else kind) for name, kind in columns.items()]
        )
        self._writer = ParquetWriter(path, self._schema, compression="zstd")
        self._rows: list[Row] = []

    def add(self, row: Row) -> None:
        """Append a row, with a value or None in every column."""
        self._rows.append(row)
        if len(self._rows) >= _GROUP_ROWS:
            self._flush()

    def add_all(self, rows: Iterable[Row]) -> None:
        """Append rows."""
        for row in rows:
            self.add(row)

    def __enter__(self) -> "TableFile":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if error is None:
            self._flush()
            self._writer.close()
        else:
            with contextlib.suppress(OSError):  # the file is discarded
                self._writer.close()

    def _flush(self) -> None:
        import pyarrow as pa

        if self._rows:
            columns = zip(*self._rows, strict=True)
            arrays = [
                _array(list(values), type_)
                for values, type_ in zip(columns, self._schema.types, strict=True)
            ]
            self._writer.write_table(pa.Table.from_arrays(arrays, schema=self._schema))
        self._rows.clear()


def _array(values: list[Any], type_: Any) -> Any:
    """Return a column; integers beyond 64 bits, which anyone can publish, become null."""
    import pyarrow as pa

    try:
        return pa.array(values, type_)
    except (OverflowError, pa.ArrowInvalid):
        kept = [value if value in _INTEGERS else None for value in values]
        return pa.array(kept, type_)
