"""Files of every version are read, and what is not a robot's file is refused."""

import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from crcolony.storage import schema as robot_schema
from crcolony.storage.reading import read_stored_robot
from crcolony.storage.sql import StorageError
from tests.support.robot_stores import (
    answered,
    decision,
    events,
    mate,
    open_store,
    proposed,
    robot,
    room_for,
    see,
    write_version_1,
)


def test_a_file_of_another_program_is_refused_and_left_alone(tmp_path: Path) -> None:
    """A text, a folder, another database, and a path that does not exist: each is named in one line."""
    text, foreign = tmp_path / "text", tmp_path / "foreign"
    text.write_text("no database at all " * 100)
    database = sqlite3.connect(foreign)
    database.execute("CREATE TABLE mine (precious TEXT)")
    database.close()
    for path in (text, foreign, tmp_path, tmp_path / "no" / "where"):
        content = path.read_bytes() if path.is_file() else b""
        for use in (open_store, read_stored_robot):
            with pytest.raises(StorageError) as refused:
                use(path)
            assert str(refused.value).startswith(f"{path}: ")
            assert "\n" not in str(refused.value)
        assert not path.is_file() or path.read_bytes() == content


def test_a_file_of_a_newer_version_is_refused(tmp_path: Path) -> None:
    """The line says what to do."""
    path = tmp_path / "robot.sqlite"
    store = open_store(path)
    store._connection.execute("PRAGMA user_version = 99")
    store.close()
    for use in (open_store, read_stored_robot):
        with pytest.raises(StorageError, match=r"newer crcolony \(version 99\); update"):
            use(path)


def test_a_file_of_an_older_version_is_migrated(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its content stays; a reader leaves the file as it is; a damaged one is refused before anything is changed."""
    path, damaged = tmp_path / "robot.sqlite", tmp_path / "damaged.sqlite"
    store = open_store(path)
    mate(store, 1)
    store.save(robot(1), events(1), tick=1)
    mate(store, 2)
    before = see(store)
    store.close()
    damaged.write_bytes(path.read_bytes())
    database = sqlite3.connect(damaged)
    database.execute("UPDATE encounters SET energy = 1.0 WHERE seq = 2")
    database.commit()
    database.close()
    later = "ALTER TABLE encounters ADD COLUMN mood TEXT NOT NULL DEFAULT 'good';"
    monkeypatch.setattr(robot_schema, "MIGRATIONS", (*robot_schema.MIGRATIONS, later))
    content = path.read_bytes()
    assert tuple(read_stored_robot(path).matings) == before.matings
    assert path.read_bytes() == content
    with pytest.raises(StorageError, match="row 2 of table encounters is damaged"):
        open_store(damaged)
    for _ in range(2):
        store = open_store(path)
        assert see(store) == before
        store.close()


def test_a_file_of_version_1_is_read(tmp_path: Path) -> None:
    """A file that version 1 wrote, not one that the present program makes."""
    path = tmp_path / "robot.sqlite"
    write_version_1(path)
    store = open_store(path)
    assert store.load() == ({"generation": 1}, 1)
    assert store.decisions_since() == [(proposed(1), decision(1))]
    assert store.open_records() == [proposed(1), answered(2)]
    assert read_stored_robot(path).events == events(1)
    assert store.begin_incarnation(5) == 1001
    store.close()


VERSION_1_TABLES = {"memory", "encounters", "events", "snapshots"}


def tables_of(path: Path) -> dict[str, list[str]]:
    """Return the names of all tables and their columns."""
    with closing(sqlite3.connect(path)) as database:
        names = database.execute("SELECT name FROM sqlite_schema WHERE type = 'table'").fetchall()
        return {
            name: [row[1] for row in database.execute(f"PRAGMA table_info({name})")]
            for (name,) in names
        }


def test_version_2_renames_the_head_and_the_incarnation(tmp_path: Path) -> None:
    """A migrated file has the tables and columns of a new one."""
    path, new = tmp_path / "robot.sqlite", tmp_path / "new.sqlite"
    write_version_1(path)
    assert set(tables_of(path)) == VERSION_1_TABLES
    open_store(path).close()
    open_store(new).close()
    assert tables_of(path) == tables_of(new)
    assert "incarnation" in tables_of(path)["head"]
    assert "incarnation" in tables_of(path)["encounters"]


def test_a_reader_migrates_a_copy_of_version_1(tmp_path: Path) -> None:
    """The file itself stays as it is, byte for byte."""
    path = tmp_path / "robot.sqlite"
    write_version_1(path)
    content = path.read_bytes()
    stored = read_stored_robot(path)
    assert (stored.incarnation, stored.events, stored.tick) == (1000, events(1), 1)
    assert path.read_bytes() == content
    assert [file.name for file in tmp_path.iterdir()] == ["robot.sqlite"]


@pytest.mark.parametrize(
    ("statement", "message"),
    [
        ("UPDATE memory SET life = 7", "the row of table memory is damaged"),
        ("UPDATE encounters SET life = 8 WHERE seq = 1", "row 1 of table encounters is damaged"),
        ("DELETE FROM events WHERE seq = 2", "rows are missing"),
    ],
)
def test_a_damaged_file_of_version_1_is_refused_before_it_is_migrated(
    tmp_path: Path, statement: str, message: str
) -> None:
    """It is checked under the names of version 1, and stays a file of version 1."""
    path = tmp_path / "robot.sqlite"
    write_version_1(path)
    with closing(sqlite3.connect(path)) as database, database:
        database.execute(statement)
    for use in (open_store, read_stored_robot):
        with pytest.raises(StorageError, match=message):
            use(path)
    assert set(tables_of(path)) == VERSION_1_TABLES


def test_a_migration_happens_whole_or_not_at_all(tmp_path: Path) -> None:
    """Whichever write fails for want of room, the file stays one of version 1, and is migrated when there is room."""
    path = tmp_path / "robot.sqlite"
    write_version_1(path)
    failures = 0
    for size in range(path.stat().st_size, 40 * 4096, 1030):
        try:
            with room_for(size):
                open_store(path).close()
        except StorageError:
            failures += 1
            assert read_stored_robot(path).incarnation == 1000
        else:
            break
    assert failures > 3
    assert "head" in tables_of(path)
    store = open_store(path)
    assert store.decisions_since() == [(proposed(1), decision(1))]
    store.close()


def test_views_and_indices_of_a_user_survive_a_migration(tmp_path: Path) -> None:
    """They follow the new names."""
    path = tmp_path / "robot.sqlite"
    write_version_1(path)
    with closing(sqlite3.connect(path)) as database, database:
        database.execute("CREATE VIEW mine AS SELECT life, energy FROM encounters")
        database.execute("CREATE INDEX by_life ON encounters (life)")
    open_store(path).close()
    with closing(sqlite3.connect(path)) as database:
        assert len(database.execute("SELECT * FROM mine").fetchall()) == 2
        (index,) = database.execute("SELECT sql FROM sqlite_schema WHERE name = 'by_life'")
        assert "incarnation" in index[0]
