"""Every event of a history is in the database, in order."""

import sqlite3
from contextlib import closing
from pathlib import Path

import msgspec
import pytest

from crcolony.evolution.history import Died
from crcolony.results.history_database import (
    TABLES,
    create_tables,
    delete_events_after,
    insert_events,
    write_history,
)
from crcolony.storage.files import FolderError
from tests.support.run_folders import rows_of
from tests.support.small_colony import Recorder, live, new_colony


@pytest.fixture(scope="module")
def recorder() -> Recorder:
    """Return the history of a small colony."""
    colony, recorder = new_colony()
    colony.start()
    live(colony)
    return recorder


def test_a_history_is_written_as_it_is(recorder: Recorder, tmp_path: Path) -> None:
    """A table for each kind of event, in place of an older database."""
    (tmp_path / "history.sqlite").write_text("an older one")
    history = [*recorder.events, Died(9000, 0, "0/1")]
    write_history(tmp_path / "history.sqlite", history)
    for kind, table in TABLES.items():
        events = [event for event in history if type(event) is kind]
        assert rows_of(tmp_path, table) == [msgspec.structs.astuple(event) for event in events]
        assert events
    assert [path.name for path in tmp_path.iterdir()] == ["history.sqlite"]


def test_events_after_a_tick_are_deleted(recorder: Recorder) -> None:
    """Those of the tick itself stay."""
    tick = recorder.events[len(recorder.events) // 2].tick
    kept = sum(event.tick <= tick for event in recorder.events)
    with closing(sqlite3.connect(":memory:")) as database:
        create_tables(database)
        insert_events(database, recorder.events)
        delete_events_after(database, tick)
        counts = [
            database.execute(f"SELECT count(*) FROM {table}").fetchone()[0]
            for table in TABLES.values()
        ]
    assert sum(counts) == kept < len(recorder.events)


def test_a_history_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    """Its folder does not exist."""
    path = tmp_path / "no" / "history.sqlite"
    with pytest.raises(FolderError, match=f"{path}: cannot be written"):
        write_history(path, [])
