"""A results folder holds a whole run, survives a disk that fails, and can be resumed."""

import contextlib
import csv
import json
import re
import sqlite3
import zipfile
from pathlib import Path

import msgspec
import numpy as np
import pytest

from crcolony.config import ConfigError, load
from crcolony.evolution.history import Lived
from crcolony.in_process.run import resume_run, start_run
from crcolony.results.history_database import TABLES
from crcolony.results.run_folder import RunFolder
from crcolony.storage.checkpoint import read_checkpoint, write_checkpoint
from crcolony.storage.files import FolderError
from tests.support.run_folders import bytes_of, finish, rows_of, run
from tests.support.small_colony import Recorder, live, new_colony, small


def test_a_folder_holds_config_versions_seed_history_and_a_table(tmp_path: Path) -> None:
    """Every event is in the database, each generation has one row, and the config is as it was."""
    config = small("seed=7")
    results = run(tmp_path / "run", config)
    colony, recorder = new_colony("seed=7")
    colony.start()
    live(colony)
    assert load(results.folder / "config.toml") == config
    described = json.loads((results.folder / "run.json").read_text())
    assert described["history_hash"] == str(recorder.hash)
    assert (described["status"], described["generations"], described["seed"]) == ("done", 3, 7)
    assert described["versions"]["numpy"] == np.__version__
    for kind, table in TABLES.items():
        events = [event for event in recorder.events if type(event) is kind]
        rows = [msgspec.structs.astuple(event) for event in events]
        assert rows_of(results.folder, table) == rows
    with (results.folder / "generations.csv").open(newline="") as file:
        table_rows = list(csv.DictReader(file))
    assert [row["generation"] for row in table_rows] == ["0", "1", "2"]
    for generation, row in enumerate(table_rows):
        matings = [v.matings for v in recorder.all(Lived) if v.generation == generation]
        assert float(row["matings"]) == pytest.approx(np.mean(matings))


def test_a_folder_with_something_in_it_is_left_alone(tmp_path: Path) -> None:
    """A new run refuses it and changes nothing."""
    (tmp_path / "mine.txt").write_text("precious")
    with pytest.raises(FolderError, match="not empty"):
        start_run(tmp_path, small())
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


def test_a_run_that_cannot_start_leaves_nothing_behind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """When the first checkpoint cannot be written the new folder is gone again, and one that was there is empty."""

    def refuse(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("crcolony.results.run_folder.write_checkpoint", refuse)
    (tmp_path / "old").mkdir()
    for folder in (tmp_path / "new", tmp_path / "old"):
        with pytest.raises(FolderError, match="No space left"):
            start_run(folder, small())
    assert [path.name for path in tmp_path.iterdir()] == ["old"]
    assert not list((tmp_path / "old").iterdir())


def test_a_row_is_added_whole_or_not_at_all(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A disk that fills up in the middle of a row leaves the table as it was."""
    results, colony = start_run(tmp_path / "run", small())
    colony.run(10_000)
    results.write_generation(colony.summary)
    table = results.folder / "generations.csv"
    before = table.read_bytes()

    write = csv.DictWriter.writerow

    def fill_up(writer: "csv.DictWriter[str]", row: dict[str, object]) -> None:
        write(writer, row)
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(csv.DictWriter, "writerow", fill_up)
    with pytest.raises(FolderError, match="No space left"):
        results.write_generation(colony.summary)
    results.close()
    assert table.read_bytes() == before


def test_two_runs_do_not_write_one_folder(tmp_path: Path) -> None:
    """The second one is refused."""
    results, _ = start_run(tmp_path / "run", small())
    with pytest.raises(FolderError, match="in use by another run"):
        resume_run(tmp_path / "run")
    results.close()
    resume_run(tmp_path / "run")[0].close()


@pytest.mark.parametrize("damage", ["truncate", "flip", "empty", "text", "missing", "other"])
def test_a_damaged_checkpoint_is_refused_by_name(tmp_path: Path, damage: str) -> None:
    """Cut short, with one byte of an array changed, empty, not a checkpoint at all, gone, or of another colony."""
    run(tmp_path / "run", small(), stop_after=1)
    path = tmp_path / "run" / "checkpoint.npz"
    content = bytearray(path.read_bytes())
    if damage == "truncate":
        path.write_bytes(content[: len(content) // 2])
    elif damage == "flip":
        with zipfile.ZipFile(path) as archive:
            largest = max(archive.infolist(), key=lambda entry: entry.file_size)
        content[largest.header_offset + largest.file_size // 2] ^= 1
        path.write_bytes(content)
    elif damage == "empty":
        path.write_bytes(b"")
    elif damage == "text":
        path.write_text("hello")
    elif damage == "other":
        run(tmp_path / "other", small("life.agents=5"), stop_after=1)
        path.write_bytes((tmp_path / "other" / "checkpoint.npz").read_bytes())
    else:
        path.unlink()
    with pytest.raises(FolderError, match=r"checkpoint\.npz"):
        resume_run(tmp_path / "run")


def test_a_checkpoint_without_what_it_needs_is_refused(tmp_path: Path) -> None:
    """An undamaged archive of other arrays."""
    run(tmp_path / "run", small(), stop_after=1)
    path = tmp_path / "run" / "checkpoint.npz"
    for content in ({"a": np.zeros(3)}, {"rest": np.frombuffer(b"\x80", dtype=np.uint8)}):
        with path.open("wb") as file:
            np.savez(file, **content)
        with pytest.raises(FolderError, match="corrupt"):
            resume_run(tmp_path / "run")


def test_a_damaged_database_or_config_is_refused_by_name(tmp_path: Path) -> None:
    """Each is named with the reason."""
    run(tmp_path / "run", small(), stop_after=1)
    (tmp_path / "run" / "history.sqlite").write_bytes(b"no database at all" * 100)
    with pytest.raises(FolderError, match=r"history\.sqlite"):
        resume_run(tmp_path / "run")
    (tmp_path / "run" / "config.toml").write_text("robots = 'four'")
    with pytest.raises(FolderError, match=r"config\.toml: changed since"):
        resume_run(tmp_path / "run")
    (tmp_path / "run" / "made_by.toml").unlink()  # as in a folder of an earlier version
    with pytest.raises(ConfigError, match=r"config\.toml: robots"):
        resume_run(tmp_path / "run")
    with pytest.raises(FolderError, match=r"config\.toml is missing"):
        resume_run(tmp_path)


@pytest.mark.parametrize(
    "name", ["config.toml", "checkpoint.npz", "history.sqlite", "run.json", "generations.csv"]
)
def test_a_run_whose_file_is_missing_is_not_resumed(tmp_path: Path, name: str) -> None:
    """The file is named, and all others stay as they are."""
    folder = run(tmp_path / "run", small("life.agents=40"), stop_after=8).folder
    (folder / name).unlink()
    before = bytes_of(folder)
    with pytest.raises(FolderError, match=re.escape(f"{folder / name}: missing")):
        resume_run(folder)
    assert bytes_of(folder) == before


def test_a_history_that_does_not_reach_the_checkpoint_is_refused(tmp_path: Path) -> None:
    """An older copy, and one with rows lost; nothing is written into them."""
    folder = run(tmp_path / "run", small("generations=1")).folder
    with contextlib.closing(sqlite3.connect(folder / "history.sqlite")) as database, database:
        database.execute("DELETE FROM matings WHERE rowid = 1")
    before = bytes_of(folder)
    with pytest.raises(FolderError, match=r"history\.sqlite: corrupt, or checkpoint\.npz"):
        resume_run(folder)
    assert bytes_of(folder) == before


def test_a_run_of_an_earlier_version_is_resumed(tmp_path: Path) -> None:
    """Its folder has no record, and its checkpoint no number of events."""
    whole = run(tmp_path / "whole", small())
    folder = run(tmp_path / "run", small(), stop_after=1).folder
    (folder / "made_by.toml").unlink()
    saved = read_checkpoint(folder / "checkpoint.npz")
    del saved["events"]
    with (folder / "checkpoint.npz").open("wb") as file:
        write_checkpoint(file, saved)
    results, colony = resume_run(folder)
    finish(results, colony)
    assert str(results.hash) == str(whole.hash)
    assert not (folder / "made_by.toml").exists()


def test_a_row_that_a_crash_cut_short_is_deleted_and_nonsense_is_refused(tmp_path: Path) -> None:
    """The table of a resumed run holds only whole rows."""
    folder = tmp_path / "run"
    run(folder, small("life.agents=40"), stop_after=8)
    table = folder / "generations.csv"
    rows = len(table.read_text().splitlines())
    assert rows > 1
    with table.open("a") as file:
        file.write("1,77")
    resume_run(folder)[0].close()
    assert len(table.read_text().splitlines()) == rows
    table.write_text(table.read_text().replace("generation", "generatoin"))
    with pytest.raises(FolderError, match=r"generations\.csv: corrupt"):
        resume_run(folder)


def test_who_records_events_changes_nothing(tmp_path: Path) -> None:
    """A recorder and a results folder receive the same history."""
    recorder = Recorder()
    results = RunFolder.claim(tmp_path / "run", small())
    for record in (recorder, results.add_event):
        colony, _ = new_colony()
        colony._record = record
        colony.start()
        live(colony)
    assert str(recorder.hash) == str(results.hash)
