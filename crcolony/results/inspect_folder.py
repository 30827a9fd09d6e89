"""Prints what is in a results folder, robot by robot (`crcolony inspect FOLDER`)."""

import contextlib
import json
import sqlite3
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

from rich.table import Table

from crcolony.config import load
from crcolony.evolution.history import Born, Died, Lived
from crcolony.results.history_database import HISTORY_DATABASE
from crcolony.storage.files import FolderError, robot_files_of_run
from crcolony.storage.reading import read_stored_robot
from crcolony.storage.sql import StorageError, connect_read_only, storage_errors
from crcolony.terminal import plain_console

_TABLE_WIDTH = 110
"""Of a table where the output is no terminal."""
_CONTENTS = {
    "history.sqlite": "the history of the run",
    "generations.csv": "one row a generation",
    "checkpoint.npz": "from which it is resumed",
    "arena.npz": "from which its arena is resumed",
    "plots": "figures",
    "logs": "the output of every process",
    "telemetry.sqlite": "a recording of its telemetry",
    "parquet": "exported tables",
}
"""What else may be in a results folder."""

_ROBOTS_OF_HISTORY = """
    SELECT robot,
        (SELECT max(generation) FROM births WHERE robot = number.robot) AS generation,
        (SELECT count(*) FROM births WHERE robot = number.robot) AS born,
        (SELECT count(*) FROM matings WHERE number.robot IN (robot, partner_robot)) AS matings,
        (SELECT count(*) FROM matings WHERE (robot = number.robot AND conceived)
            OR (partner_robot = number.robot AND partner_conceived)) AS offspring,
        (SELECT count(*) FROM deaths WHERE robot = number.robot) AS starved,
        (SELECT sum(captures) FROM lives WHERE robot = number.robot) AS batteries
    FROM (SELECT DISTINCT robot FROM births) AS number ORDER BY robot
"""
"""A row for every robot of an in-process run."""


def inspect_folder(folder: Path) -> None:
    """Print what is in the results folder of a run, or of a comparison; raises CrcolonyError for any other folder."""
    console = plain_console()
    if not console.is_terminal:
        console.width = _TABLE_WIDTH
    if not (folder / "config.toml").exists():
        runs = sorted(path.parent for path in folder.glob("*/seed-*/config.toml"))
        if not runs:
            raise FolderError(
                f"{folder}: neither a results folder (config.toml) nor a robot's (robot.sqlite)"
            )
        console.print(f"{folder}: a comparison of {len(runs)} runs", soft_wrap=True)
        for run in runs:
            console.print(f"  {run}: {_format_progress(run)}", soft_wrap=True)
        return
    files = robot_files_of_run(folder)
    what = "a colony of processes" if files else "a run in one process"
    console.print(f"{folder}: {what}, {_format_progress(folder)}", soft_wrap=True)
    table = Table(box=None, pad_edge=False)
    rows, damaged = [], []
    for path in files:
        try:
            rows.append(_row_of_file(path))
        except StorageError as error:
            damaged.append(str(error))
    rows = rows or [*_rows_of_history(folder)]
    for name in rows[0] if rows else ():
        is_text = name in ("id", "saved")
        table.add_column(name, justify="left" if is_text else "right", overflow="fold")
    for row in rows:
        table.add_row(*map(str, row.values()))
    console.print(table)
    for line in damaged:
        console.print(line, soft_wrap=True)
    for name, content in _CONTENTS.items():
        if (folder / name).exists():
            console.print(f"{folder / name}: {content}", soft_wrap=True)
    if files:
        console.print(f"{files[0]}: a robot's file (crcolony inspect)", soft_wrap=True)


def _format_progress(folder: Path) -> str:
    """Return how far a run is, and with which settings, as text; raises ConfigError."""
    config = load(folder / "config.toml")
    state: dict[str, Any] = {}
    with contextlib.suppress(OSError, ValueError):
        state = json.loads((folder / "run.json").read_text("utf-8"))
    last = f" of {config.generations}" if config.generations else ""
    text = f"{config.robots} robots, {config.selection} selection, seed {config.seed}"
    if "generations" in state:
        text += f"; {state.get('status')} in generation {state['generations']}{last}"
        text += f"; history hash: {state.get('history_hash')}"
    return text


def _row_of_file(path: Path) -> dict[str, object]:
    """Return the row of a robot with a file of its own; raises StorageError."""
    stored = read_stored_robot(path)
    saved = "never"
    if stored.saved_unix_s is not None:
        saved = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(stored.saved_unix_s))
    decisions = [decision for _, decision in stored.matings if decision is not None]
    return {
        "robot": path.parent.name,
        "id": stored.robot.hex()[:8],
        "generation": "-" if stored.generation is None else stored.generation,
        "born": _count(stored.events, Born),
        "matings": len(decisions),
        "offspring": sum(decision.conceived for decision in decisions),
        "starved": _count(stored.events, Died),
        "batteries": sum(event.captures for event in stored.events if isinstance(event, Lived)),
        "open": sum(record.is_unresolved for record, _ in stored.matings),
        "starts": stored.incarnation,
        "saved": saved,
    }


def _rows_of_history(folder: Path) -> Iterator[dict[str, object]]:
    path = folder / HISTORY_DATABASE
    if not path.exists():
        return
    with storage_errors(path), closing(connect_read_only(path)) as database:
        database.row_factory = sqlite3.Row
        for row in database.execute(_ROBOTS_OF_HISTORY):
            yield {name: 0 if row[name] is None else row[name] for name in row.keys()}  # noqa: SIM118


def _count(events: list[Any], kind: type) -> int:
    return sum(isinstance(event, kind) for event in events)
