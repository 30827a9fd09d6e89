"""A telemetry file of version 1 is read as it is, and upgraded when a recording continues it; nothing is lost."""

import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from crcolony.recordings.telemetry_file import TelemetryFile, read_samples
from crcolony.recordings.telemetry_schema import TelemetryError
from crcolony.telemetry.samples import RawSample
from tests.support.raw_samples import record

VERSION_1 = """
    CREATE TABLE meta (name TEXT PRIMARY KEY, value TEXT NOT NULL);
    CREATE TABLE heard (unix_ms INTEGER NOT NULL, kind TEXT NOT NULL, key TEXT NOT NULL, data BLOB NOT NULL);
    CREATE INDEX tokens ON heard (key) WHERE kind IN ('alive', 'gone');
    INSERT INTO meta VALUES ('application', 'crcolony telemetry'), ('version', '1');
"""
"""As version 1 created its tables."""
SAMPLES = [
    RawSample("online", "robot/0", b"", 1),
    RawSample("online", "robot/1", b"", 2),
    RawSample("state", "robot/0/state", b"\x01\x02", 3),
    RawSample("metadata", "robot/0/metadata", b"{}", 4),
    RawSample("offline", "robot/0", b"", 5),
]
OLD_KINDS = {"online": "alive", "offline": "gone"}


@pytest.fixture
def old_file(tmp_path: Path) -> Path:
    """A file of version 1 with the samples."""
    path = tmp_path / "telemetry.sqlite"
    with closing(sqlite3.connect(path)) as database, database:
        database.executescript(VERSION_1)
        rows = [(s.unix_ms, OLD_KINDS.get(s.kind, s.kind), s.key, s.payload) for s in SAMPLES]
        database.executemany("INSERT INTO heard VALUES (?, ?, ?, ?)", rows)
    return path


def version_of(path: Path) -> str:
    with closing(sqlite3.connect(path)) as database:
        (version,) = database.execute("SELECT value FROM meta WHERE name = 'version'").fetchone()
    return str(version)


def test_a_file_of_version_1_is_read(old_file: Path) -> None:
    """Byte by byte, with the present names of the kinds; the file is not changed."""
    before = old_file.read_bytes()
    assert list(read_samples(old_file)) == SAMPLES
    assert list(read_samples(old_file, ["metadata"])) == [SAMPLES[3]]
    assert list(read_samples(old_file, ["offline", "online"])) == [*SAMPLES[:2], SAMPLES[4]]
    assert old_file.read_bytes() == before


def test_a_file_of_version_1_is_upgraded_when_it_is_continued(old_file: Path) -> None:
    """All samples stay, and robots that were online are recorded as offline, as in any continued file."""
    new = RawSample("online", "robot/2", b"", 9)
    record(old_file, [new])
    assert version_of(old_file) == "2"
    offline = RawSample("offline", "robot/1", b"", 5)
    assert list(read_samples(old_file)) == [*SAMPLES, offline, new]
    record(old_file, [])
    assert list(read_samples(old_file))[-1] == RawSample("offline", "robot/2", b"", 9)


def test_an_upgrade_that_fails_leaves_the_file_as_it_was(old_file: Path) -> None:
    """Here it fails half-way, at a table with the new name; the file can be read, and upgraded later."""
    with closing(sqlite3.connect(old_file)) as database:
        database.execute("CREATE TABLE samples (number INTEGER)")
    with pytest.raises(TelemetryError, match=f"^{old_file}: cannot be written: "):
        TelemetryFile.open(old_file)
    assert version_of(old_file) == "1"
    assert list(read_samples(old_file)) == SAMPLES
    with closing(sqlite3.connect(old_file)) as database:
        database.execute("DROP TABLE samples")
    record(old_file, [])
    assert list(read_samples(old_file))[:5] == SAMPLES


def test_a_new_file_has_version_2(tmp_path: Path) -> None:
    """And an unknown version is refused, with the name of the file."""
    path = record(tmp_path / "t.sqlite", SAMPLES)
    assert version_of(path) == "2"
    with closing(sqlite3.connect(path)) as database, database:
        database.execute("UPDATE meta SET value = '3' WHERE name = 'version'")
    with pytest.raises(TelemetryError, match=f"^{path}: a telemetry file of another version"):
        list(read_samples(path))
