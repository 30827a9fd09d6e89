"""Damage to a robot's file is found; what a user adds to it is not damage."""

import sqlite3
from pathlib import Path

import pytest

from crcolony.storage.integrity import Head
from crcolony.storage.reading import read_stored_robot
from crcolony.storage.sql import StorageError
from tests.support.robot_stores import (
    ME,
    PEER,
    answered,
    events,
    mate,
    open_store,
    robot,
)


@pytest.mark.parametrize("seq", [1, 2, 4])
@pytest.mark.parametrize("table", ["encounters", "events"])
def test_a_lost_row_is_found(tmp_path: Path, table: str, seq: int) -> None:
    """The first, one in the middle, and the last, which leaves no gap."""
    path = tmp_path / "robot.sqlite"
    store = open_store(path)
    store.write([answered(number) for number in range(4)])
    store.save(robot(1), events(1) + events(2), tick=2)
    store._connection.execute(f"DELETE FROM {table} WHERE seq = ?", (seq,))
    store.close()
    for use in (open_store, read_stored_robot):
        with pytest.raises(StorageError, match="corrupt: row"):
            use(path)


def test_what_a_user_adds_does_not_count_as_damage(tmp_path: Path) -> None:
    """A file can be queried with SQL while the robot runs, and have a view and an index of the user's."""
    path = tmp_path / "robot.sqlite"
    store = open_store(path)
    mate(store, 4)
    store.save(robot(1), events(1), tick=1)
    with sqlite3.connect(path) as database:
        query = "SELECT initiator, responder, state, energy, conceived FROM encounters"
        assert database.execute(query).fetchall() == [(ME.hex(), PEER.hex(), "decided", 4 / 7, 1)]
        kinds = database.execute("SELECT seq, tick, kind FROM events").fetchall()
        assert kinds == [(1, 1, "Died"), (2, 1, "TurnedOver")]
        database.execute("CREATE VIEW conceptions AS SELECT * FROM encounters WHERE conceived")
        database.execute("CREATE INDEX mine ON encounters (energy)")
    database.close()
    store.close()
    open_store(path).close()


@pytest.mark.parametrize(
    ("statement", "message"),
    [
        ("UPDATE head SET serial = serial + 1", "the row of table head is damaged"),
        ("DELETE FROM head", "the row of table head is damaged"),
        ("UPDATE encounters SET tick = 7 WHERE seq = 1", "row 1 of table encounters is damaged"),
        ("UPDATE events SET body = x'00' WHERE seq = 2", "row 2 of table events is damaged"),
        ("DELETE FROM snapshots", "a snapshot is missing"),
        ("ALTER TABLE events ADD COLUMN mine TEXT", "its table definitions were changed"),
    ],
)
def test_a_changed_row_or_table_is_named(tmp_path: Path, statement: str, message: str) -> None:
    """The robot and readers refuse the file with the same line."""
    path = tmp_path / "robot.sqlite"
    store = open_store(path)
    mate(store, 1)
    store.save(robot(1), events(1), tick=1)
    store._connection.execute(statement)
    store.close()
    for use in (open_store, read_stored_robot):
        with pytest.raises(StorageError, match=message):
            use(path)


def test_rows_of_an_earlier_moment_are_found(tmp_path: Path) -> None:
    """A row that is whole, with a valid digest, but older than the head."""
    path = tmp_path / "robot.sqlite"
    store = open_store(path)
    record = answered(1)
    store.write([record])
    (before,) = store._connection.execute("SELECT * FROM encounters").fetchall()
    store.write([answered(1, "aborted")])
    store._connection.execute("DELETE FROM encounters")
    marks = ", ".join("?" * len(before))
    store._connection.execute(f"INSERT INTO encounters VALUES ({marks})", before)
    store.close()
    with pytest.raises(StorageError, match="rows are missing, or of different moments"):
        open_store(path)


def test_a_digest_that_is_toggled_twice_is_not_in_the_total() -> None:
    """The total does not depend on the order of rows."""
    one, other = bytes(range(16)), bytes(range(1, 17))
    first, second = Head("", b""), Head("", b"")
    for digest in (one, other):
        first.toggle(digest)
    for digest in (other, one):
        second.toggle(digest)
    assert first.total == second.total
    first.toggle(one)
    first.toggle(other)
    assert first.total == bytes(16)


def test_the_base_is_the_newest_undamaged_snapshot() -> None:
    """The newest, or the one before it, or none."""
    head = Head("", b"", newest=9, older=4)
    assert head.base_serial(frozenset()) == 9
    assert head.base_serial(frozenset({9})) == 4
    assert Head("", b"").base_serial(frozenset()) == 0
