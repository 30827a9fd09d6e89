"""Runs of in-process colonies into results folders, stopped and resumed, and what is in their histories."""

import sqlite3
from contextlib import closing
from pathlib import Path

from crcolony.config import Config
from crcolony.in_process.colony import InProcessColony
from crcolony.in_process.run import run_until_done, start_run
from crcolony.results.run_folder import RunFolder


def run(folder: Path, config: Config, stop_after: int = 10**9) -> RunFolder:
    """Run a colony until its end, or until it has checked `stop_after` times whether to stop."""
    results, colony = start_run(folder, config)
    finish(results, colony, stop_after)
    return results


def finish(results: RunFolder, colony: InProcessColony, stop_after: int = 10**9) -> None:
    """Run a colony that was started or resumed, and close its folder."""
    checks = iter(range(stop_after))
    run_until_done(results, colony, lambda: next(checks, None) is None, lambda _: None)
    results.close()


def bytes_of(folder: Path) -> dict[str, bytes]:
    """Return the content of every file in a folder and its subfolders."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def rows_of(folder: Path, table: str) -> list[tuple[object, ...]]:
    """Return the rows of a table of a run's history."""
    with closing(sqlite3.connect(folder / "history.sqlite")) as database:
        return database.execute(f"SELECT * FROM {table}").fetchall()
