"""A finished run, read from its results folder: settings, robots and history."""

import contextlib
import heapq
import json
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

import msgspec

from crcolony.config import Config, load
from crcolony.errors import CrcolonyError
from crcolony.evolution.history import Born, Died, Event, Lived, Mated, TurnedOver
from crcolony.protocol.identity import ID_BYTES, RobotId, seeded
from crcolony.storage.files import robot_files_of_run
from crcolony.storage.folder_record import read_record
from crcolony.storage.reading import read_stored_robot
from crcolony.storage.sql import StorageError

COLONY = "colony"
"""The name of a colony without a name of its own."""
_TABLES: tuple[tuple[str, type[Event], int], ...] = (
    ("deaths", Died, 0),
    ("matings", Mated, 1),
    ("turnovers", TurnedOver, 2),
    ("lives", Lived, 2),
    ("births", Born, 3),
)
"""The tables of a history, their events, and the order of the events within a tick."""


class PastRunError(CrcolonyError):
    """A results folder does not describe its run: the message names the file and the reason."""


@dataclass(frozen=True)
class PastRun:
    """A finished run."""

    folder: Path
    config: Config
    colony: str
    robots: tuple[RobotId, ...]
    """By their numbers in the history."""
    generations: int
    """Generations that all robots have finished"""
    history_hash: str
    start_unix_ms: int
    """When its folder was created"""
    population: str = ""
    """The digest of what its robots began with; empty: random genotypes"""

    @property
    def history(self) -> Path:
        """Path of its history."""
        return self.folder / "history.sqlite"

    @property
    def is_repeatable(self) -> bool:
        """Whether it can be re-simulated: its robots are those of an in-process or lockstep colony of this config."""
        return self.robots == _seeded_robots(self.config, self.colony, self.population)


def read_run(folder: Path) -> PastRun:
    """Read a results folder; raises PastRunError, or ConfigError."""
    settings, path = folder / "config.toml", folder / "run.json"
    if not settings.is_file():
        raise PastRunError(f"{folder}: no results folder: config.toml is missing")
    config = load(settings)
    if not path.is_file():
        raise PastRunError(f"{path}: missing; it is written when the run ends")
    try:
        message: dict[str, Any] = json.loads(path.read_text("utf-8"))
        names = message.get("robots")
        colony = COLONY if names is None else _colony_of(folder)
        population = _population_of(folder)
        return PastRun(
            folder=folder,
            config=config,
            colony=colony,
            robots=_seeded_robots(config, colony, population) if names is None else _ids(names),
            generations=int(message["generations"]),
            history_hash=str(message["history_hash"]),
            start_unix_ms=int(1000.0 * settings.stat().st_mtime),
            population=population,
        )
    except OSError as error:
        raise PastRunError(f"{path}: cannot be read: {error.strerror}") from None
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise PastRunError(f"{path}: not a description of a run: {error}") from None


def _seeded_robots(config: Config, colony: str, population: str) -> tuple[RobotId, ...]:
    return tuple(
        seeded(colony, config.seed, number, population).id for number in range(config.robots)
    )


def _population_of(folder: Path) -> str:
    """Return the digest of what a run's robots began with; empty: random genotypes."""
    record = read_record(folder)
    return record.origin.population if record is not None and record.origin is not None else ""


def _ids(names: list[str]) -> tuple[RobotId, ...]:
    robots = tuple(bytes.fromhex(name) for name in names)
    if any(len(robot) != ID_BYTES for robot in robots):
        raise ValueError("robots: not ids of 32 hex digits")
    return robots


def _colony_of(folder: Path) -> str:
    """Return the name of the colony, as its robots have stored it."""
    for store in robot_files_of_run(folder):
        with contextlib.suppress(StorageError):  # the next robot has stored it as well
            colony = read_stored_robot(store).colony
            if colony is not None:
                return colony
    return COLONY


def read_history(path: Path) -> Iterator[Event]:
    """Yield the events of a history in order, as the run hashed them; raises PastRunError."""
    if not path.is_file():
        raise PastRunError(f"{path}: missing; it is written when the run ends")
    try:
        with closing(
            sqlite3.connect(f"file:{quote(str(path.absolute()))}?mode=ro", uri=True)
        ) as it:
            tables = [_events(it, *table) for table in _TABLES]
            for _, event in heapq.merge(*tables, key=lambda entry: entry[0]):
                yield event
    except (sqlite3.Error, msgspec.ValidationError) as error:
        raise PastRunError(f"{path}: cannot be read: {error}") from None


def _events(
    database: sqlite3.Connection, table: str, kind: type[Event], order: int
) -> Iterator[tuple[tuple[int, int, int], Event]]:
    for row in database.execute(f"SELECT * FROM {table} ORDER BY rowid"):
        event = msgspec.convert((kind.__name__, *row), kind, strict=False)
        yield (event.tick, order, event.robot), event
