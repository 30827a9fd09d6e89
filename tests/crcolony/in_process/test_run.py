"""A run can be stopped, killed and resumed, and its history stays the same."""

import json
from pathlib import Path

import pytest

from crcolony.config import ConfigError, load
from crcolony.in_process.run import is_finished, read_colony, resume_run, start_run
from crcolony.results.history_database import TABLES
from crcolony.storage.files import FolderError
from tests.support.run_folders import finish, rows_of, run
from tests.support.small_colony import live, new_colony, small


def test_a_run_that_was_stopped_and_resumed_equals_one_that_was_not(tmp_path: Path) -> None:
    """History hash, database and table are equal to those of an undisturbed run."""
    config = small("life.agents=40", "generations=2")
    whole = run(tmp_path / "whole", config)
    run(tmp_path / "parts", config, stop_after=1)
    described = json.loads((tmp_path / "parts" / "run.json").read_text())
    assert described["status"] == "stopped"
    assert described["generations"] == 0
    results, colony = resume_run(tmp_path / "parts")
    assert colony.tick > 0
    finish(results, colony)
    assert str(results.hash) == str(whole.hash)
    for table in TABLES.values():
        assert rows_of(results.folder, table) == rows_of(whole.folder, table)
    name = "generations.csv"
    assert (results.folder / name).read_bytes() == (whole.folder / name).read_bytes()


def test_what_came_after_the_last_checkpoint_is_repeated(tmp_path: Path) -> None:
    """A run killed long after its checkpoint continues from there, and no event is in its history twice."""
    config = small()
    whole = run(tmp_path / "whole", config)
    folder = tmp_path / "killed"
    results, colony = start_run(folder, config)
    for _ in range(2):
        colony.run(10_000)
        results.write_generation(colony.summary)
    results.close()
    finish(*resume_run(folder))
    assert rows_of(folder, "births") == rows_of(whole.folder, "births")
    name = "generations.csv"
    assert (folder / name).read_bytes() == (whole.folder / name).read_bytes()


def test_a_finished_run_that_is_resumed_stays_as_it_is(tmp_path: Path) -> None:
    """There is nothing left to do."""
    whole = run(tmp_path / "run", small())
    results, colony = resume_run(tmp_path / "run")
    finish(results, colony)
    assert str(results.hash) == str(whole.hash)


def test_a_colony_larger_than_the_machine_is_refused(tmp_path: Path) -> None:
    """Before anything is made."""
    with pytest.raises(ConfigError, match="GB of memory"):
        start_run(tmp_path / "run", load(None, ["robots=10000", "life.agents=1000"]))
    assert not (tmp_path / "run").exists()


def test_a_colony_that_finds_no_free_place_is_refused(tmp_path: Path) -> None:
    """Many thin pillars leave enough free area, but no place for a robot."""
    steps = range(-7, 8)
    forest = [[0.16 * i, 0.16 * j, 0.01] for i in steps for j in steps]
    config = load(None, ["arena.width_m=2.0", f"arena.pillars={forest}"])
    with pytest.raises(ConfigError, match="no free place"):
        start_run(tmp_path / "run", config)


def test_a_run_is_finished_after_the_last_generation_of_its_config() -> None:
    """With 0 generations it never is."""
    for generations, expected in ((2, True), (4, False), (0, False)):
        colony, _ = new_colony(f"generations={generations}")
        colony.start()
        live(colony, 2)
        assert is_finished(colony) is expected


def test_the_colony_of_a_folder_lives_on_outside_of_it(tmp_path: Path) -> None:
    """It does what a resumed run would do, and the folder stays as it is."""
    run(tmp_path, small())
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    colony = read_colony(tmp_path)
    live(colony, colony.generation + 1)
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before
    results, resumed = resume_run(tmp_path)
    live(resumed, resumed.generation + 1)
    results.close()
    assert colony.summary == resumed.summary


def test_a_folder_whose_checkpoint_holds_no_colony_is_named(tmp_path: Path) -> None:
    """Missing, damaged, or of other settings."""
    run(tmp_path, small())
    checkpoint, config = tmp_path / "checkpoint.npz", tmp_path / "config.toml"
    config.write_text(config.read_text().replace("agents = 4", "agents = 5"))
    for spoil in (lambda: None, lambda: checkpoint.write_bytes(b"no"), checkpoint.unlink):
        spoil()
        with pytest.raises(FolderError, match=r"checkpoint\.npz: holds no colony"):
            read_colony(tmp_path)
