"""The results folder of an embedded run: config, versions, history, a table by generation, and a checkpoint.

    config.toml        the effective config
    run.json           versions, seed, how far the run is, its history hash
    history.sqlite     every birth (with its genes), mating, death, life and turnover
    generations.csv    one row a generation
    checkpoint.npz     the whole colony, to go on from

A generation is written in one transaction, and a file is replaced whole or not at all, so that a run that is killed
leaves a folder that can be resumed.
"""

import csv
import io
import json
import os
import platform
import sqlite3
from collections.abc import Iterable, Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from crcolony.colony.history import Born, Died, Event, HistoryHash, Lived, Mated, TurnedOver
from crcolony.config import Config, ConfigError, load, to_toml

_TABLES = {
    Born: "births",
    Mated: "matings",
    Died: "deaths",
    Lived: "lives",
    TurnedOver: "turnovers",
}
_SQL_TYPES = {int: "INTEGER", float: "REAL", bool: "INTEGER", bytes: "BLOB"}
_PACKAGES = ("crcolony", "numpy", "numba", "pymunk", "msgspec")


class ResultsError(Exception):
    """A results folder cannot be read or written: the message names the file and the reason."""


class Results:
    """Writes a run into its folder; raises ResultsError when the outside (disk, files) refuses."""

    def __init__(self, folder: Path, config: Config) -> None:
        self.folder = folder
        self.config = config
        self.hash = HistoryHash()
        self._events: list[Event] = []
        self._database: sqlite3.Connection | None = None

    @classmethod
    def create(cls, folder: Path, config: Config) -> "Results":
        """Make a new folder; raises ResultsError if there is something in it already."""
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if any(folder.iterdir()):
                raise ResultsError(f"{folder}: not empty; choose another --out or use --resume")
            _replace(folder / "config.toml", to_toml(config).encode())
        except OSError as error:
            raise ResultsError(f"{folder}: {error.strerror}") from None
        results = cls(folder, config)
        results._open()
        return results

    @classmethod
    def resume(cls, folder: Path) -> tuple["Results", dict[str, Any]]:
        """Open a folder to go on; return it and the saved colony. What came after the checkpoint is forgotten."""
        if not (folder / "config.toml").is_file():
            raise ResultsError(f"{folder}: no results folder: config.toml is missing")
        try:
            config = load(folder / "config.toml")
        except ConfigError as error:
            raise ResultsError(str(error)) from None
        results = cls(folder, config)
        saved = read_checkpoint(folder / "checkpoint.npz")
        results.hash = HistoryHash(bytes.fromhex(saved["hash"]))
        results._open()
        results._forget_after(saved["tick"], saved["generation"])
        return results, saved

    def record(self, event: Event) -> None:
        """Take one event of the history."""
        self.hash.add(event)
        self._events.append(event)

    def write_generation(self, row: Mapping[str, Any]) -> None:
        """Write a finished generation: its row of the table, and the events since the last."""
        path = self.folder / "generations.csv"
        try:
            self._flush()
            is_new = not path.exists()
            with path.open("a", newline="", encoding="utf-8") as file:
                writer = csv.DictWriter(file, fieldnames=list(row))
                if is_new:
                    writer.writeheader()
                writer.writerow(row)
        except (OSError, sqlite3.Error) as error:
            raise ResultsError(f"{self.folder}: cannot be written: {error}") from None

    def write_checkpoint(self, colony: dict[str, Any], generation: int, status: str) -> None:
        """Save the whole colony and say how far the run is."""
        try:
            self._flush()
            _replace(self.folder / "checkpoint.npz", pack_checkpoint(colony, str(self.hash)))
            _replace(self.folder / "run.json", self._describe(generation, status))
        except (OSError, sqlite3.Error) as error:
            raise ResultsError(f"{self.folder}: cannot be written: {error}") from None

    def close(self) -> None:
        """Let the database go, as one file that can be copied and read anywhere."""
        if self._database is not None:
            self._database.execute("PRAGMA journal_mode=DELETE")
            self._database.close()

    def _describe(self, generation: int, status: str) -> bytes:
        return json.dumps(
            {
                "status": status,
                "generations": generation,
                "seed": self.config.seed,
                "history_hash": str(self.hash),
                "python": platform.python_version(),
                "versions": {name: _version(name) for name in _PACKAGES},
            },
            indent=2,
        ).encode()

    def _open(self) -> None:
        try:
            self._database = sqlite3.connect(self.folder / "history.sqlite")
            self._database.execute("PRAGMA journal_mode=WAL")
            self._database.execute("PRAGMA synchronous=NORMAL")
            for kind, table in _TABLES.items():
                columns = ", ".join(_columns(kind))
                self._database.execute(f"CREATE TABLE IF NOT EXISTS {table} ({columns})")
            self._database.commit()
        except sqlite3.Error as error:
            raise ResultsError(f"{self.folder / 'history.sqlite'}: {error}") from None

    def _flush(self) -> None:
        assert self._database is not None
        with self._database:
            for kind, table in _TABLES.items():
                rows = [msgspec.structs.astuple(e) for e in self._events if type(e) is kind]
                marks = ", ".join("?" * len(kind.__struct_fields__))
                self._database.executemany(f"INSERT INTO {table} VALUES ({marks})", rows)
        self._events.clear()

    def _forget_after(self, tick: int, generation: int) -> None:
        assert self._database is not None
        try:
            with self._database:
                for table in _TABLES.values():
                    self._database.execute(f"DELETE FROM {table} WHERE tick > ?", (tick,))
            path = self.folder / "generations.csv"
            if path.exists():
                rows = read_table(path)
                kept = [row for row in rows if int(row["generation"]) < generation]
                _replace(path, _as_csv(kept))
        except (OSError, sqlite3.Error) as error:
            raise ResultsError(f"{self.folder}: cannot be resumed: {error}") from None


def pack_checkpoint(colony: dict[str, Any], history_hash: str) -> bytes:
    """Return a saved colony as one file: its arrays by path, and the rest as MessagePack."""
    arrays: dict[str, np.ndarray] = {}
    rest = _take_arrays({**colony, "hash": history_hash}, "", arrays)
    arrays["rest"] = np.frombuffer(msgspec.msgpack.encode(rest), dtype=np.uint8)
    file = io.BytesIO()
    np.savez(file, **arrays)  # type: ignore[arg-type]
    return file.getvalue()


def read_checkpoint(path: Path) -> dict[str, Any]:
    """Read what `pack_checkpoint` wrote; raises ResultsError for a file that is missing or corrupt."""
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        rest = msgspec.msgpack.decode(arrays.pop("rest").tobytes())
        saved: dict[str, Any] = _put_arrays(rest, arrays)
    except FileNotFoundError:
        raise ResultsError(f"{path}: missing; the run wrote no checkpoint") from None
    except Exception as error:
        raise ResultsError(f"{path}: corrupt: {error}") from None
    return saved


def read_table(path: Path) -> list[dict[str, str]]:
    """Read a table by generation; raises ResultsError if it cannot be read."""
    try:
        with path.open(newline="", encoding="utf-8") as file:
            return list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ResultsError(f"{path}: cannot be read: {error}") from None


def _take_arrays(tree: Any, path: str, arrays: dict[str, np.ndarray]) -> Any:
    """Move every array of a tree into `arrays`, leaving its path in its place."""
    if isinstance(tree, np.ndarray):
        arrays[path] = tree
        return {"array": path}
    if isinstance(tree, dict):
        return {key: _take_arrays(value, f"{path}.{key}", arrays) for key, value in tree.items()}
    if isinstance(tree, list | tuple):
        return [_take_arrays(value, f"{path}.{k}", arrays) for k, value in enumerate(tree)]
    return tree


def _put_arrays(tree: Any, arrays: Mapping[str, np.ndarray]) -> Any:
    if isinstance(tree, dict):
        if set(tree) == {"array"}:
            return arrays[tree["array"]]
        return {key: _put_arrays(value, arrays) for key, value in tree.items()}
    if isinstance(tree, list):
        return [_put_arrays(value, arrays) for value in tree]
    return tree


def _columns(kind: Any) -> Iterable[str]:
    for field in msgspec.structs.fields(kind):
        yield f"{field.name} {_SQL_TYPES.get(field.type, 'TEXT')}"


def _as_csv(rows: list[dict[str, str]]) -> bytes:
    if not rows:
        return b""
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, fieldnames=list(rows[0]))
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue().encode()


def _replace(path: Path, content: bytes) -> None:
    """Write a file whole or not at all."""
    draft = path.with_name(path.name + ".part")
    try:
        with draft.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        draft.replace(path)
    finally:
        draft.unlink(missing_ok=True)


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
