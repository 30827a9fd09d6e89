"""A robot's file is read as a whole, at any time, without changing it."""

from pathlib import Path

import pytest

from crcolony.storage.reading import read_stored_robot
from crcolony.storage.sql import StorageError
from tests.support.robot_stores import (
    ME,
    SCHEMA,
    decision,
    events,
    mate,
    open_store,
    proposed,
    robot,
)


def test_a_file_is_read_while_its_robot_runs(tmp_path: Path) -> None:
    """What was written last is there, and the robot writes on meanwhile."""
    path = tmp_path / "robot.sqlite"
    store = open_store(path)
    for number in (1, 2):
        mate(store, number)
        stored = read_stored_robot(path)
        assert [record for record, _ in stored.matings] == [proposed(n + 1) for n in range(number)]
        assert stored.matings[-1] == (proposed(number), decision(number))
    store.close()


def test_a_robot_that_has_saved_nothing_is_read(tmp_path: Path) -> None:
    """It has no tick, no generation and no colony yet."""
    path = tmp_path / "robot.sqlite"
    open_store(path).close()
    stored = read_stored_robot(path)
    assert (stored.robot, stored.schema, stored.incarnation) == (ME, SCHEMA, 0)
    assert (stored.tick, stored.saved_unix_s, stored.generation, stored.colony) == (None,) * 4
    assert (stored.matings, stored.events, stored.pool) == ([], [], [])


def test_of_a_damaged_snapshot_the_one_before_is_read(tmp_path: Path) -> None:
    """With the events up to it; the file stays as it is."""
    path = tmp_path / "robot.sqlite"
    store = open_store(path)
    store.save(robot(1), events(1), tick=1)
    store.save(robot(2), events(2), tick=2)
    newest = "(SELECT newest FROM head)"
    store._connection.execute(f"UPDATE snapshots SET robot = x'00' WHERE serial = {newest}")
    store.close()
    content = path.read_bytes()
    stored = read_stored_robot(path)
    assert (stored.tick, stored.events, stored.generation) == (1, events(1), 1)
    assert path.read_bytes() == content


def test_a_file_that_is_missing_or_empty_is_refused(tmp_path: Path) -> None:
    """And none is made."""
    with pytest.raises(StorageError, match="there is no such file"):
        read_stored_robot(tmp_path / "robot.sqlite")
    assert not list(tmp_path.iterdir())
    (tmp_path / "robot.sqlite").touch()
    with pytest.raises(StorageError, match="it is empty"):
        read_stored_robot(tmp_path / "robot.sqlite")
