"""A colony of processes goes on in its own folder, with its own settings, robots and founders."""

import os
from pathlib import Path

import pytest

from crcolony.config import load
from crcolony.evolution.founders import Founders
from crcolony.results.colony_folder import open_colony_folder
from crcolony.results.earlier_run import read_earlier_run
from crcolony.storage.files import FolderError
from crcolony.storage.folder_record import read_record
from crcolony.storage.founders_file import Beginning, read_founders
from tests.support.run_folders import bytes_of, run
from tests.support.small_colony import small


@pytest.fixture(scope="module")
def beginning(tmp_path_factory: pytest.TempPathFactory) -> Beginning:
    """What robots begin with that come from a run of four robots."""
    folder = run(tmp_path_factory.mktemp("runs") / "1", small("generations=1")).folder
    return read_earlier_run(folder).beginning(small())


def first_genes(founders: Founders | None, robot: int = 0) -> list[float]:
    assert founders is not None
    return list(founders.of_robot(robot, 1)[0].genes)


def test_a_colony_goes_on_with_its_own_settings_only(tmp_path: Path) -> None:
    """The first setting that differs is named with both values, and nothing is changed."""
    open_colony_folder(tmp_path, "launch", small("seed=3"), None).__exit__()
    before = bytes_of(tmp_path)
    with pytest.raises(FolderError, match=r"of other settings: seed is 3 there, 4 here"):
        open_colony_folder(tmp_path, "launch", small("seed=4"), None)
    with pytest.raises(FolderError, match=r"life\.agents is 4 there, 5 here"):
        open_colony_folder(tmp_path, "launch", small("seed=3", "life.agents=5"), None)
    with pytest.raises(FolderError, match="made by crcolony launch"):
        open_colony_folder(tmp_path, "host", small("seed=3"), None)
    assert bytes_of(tmp_path) == before
    with open_colony_folder(tmp_path, "launch", small("seed=3"), None) as folder:
        assert folder.founders is None


def test_every_robot_has_its_share_of_the_founders_in_its_folder(
    tmp_path: Path, beginning: Beginning
) -> None:
    """It needs neither the earlier run nor the folder of the colony; dealt out again to more robots."""
    with open_colony_folder(tmp_path, "launch", small(), beginning) as folder:
        own = [folder.prepare_robot(number) for number in range(6)]
    for number, place in enumerate(own):
        expected = first_genes(beginning.founders, number)
        assert first_genes(read_founders(place)) == expected
        record = read_record(place)
        assert record is not None
        assert record.origin == beginning.origin


def test_a_colony_goes_on_with_what_it_began_with(tmp_path: Path, beginning: Beginning) -> None:
    """Whatever the command line says now: a robot that is added later gets its share too."""
    open_colony_folder(tmp_path, "host", small(), beginning).__exit__()
    with open_colony_folder(tmp_path, "host", small(), None) as folder:
        assert first_genes(folder.founders, 2) == first_genes(beginning.founders, 2)
        assert folder.population == beginning.origin.population
        assert first_genes(read_founders(folder.prepare_robot(2))) == first_genes(
            beginning.founders, 2
        )


@pytest.mark.parametrize("name", ["config.toml", "founders.npz"])
def test_a_missing_file_is_named(tmp_path: Path, beginning: Beginning, name: str) -> None:
    """And nothing is made in its place."""
    open_colony_folder(tmp_path, "launch", small(), beginning).__exit__()
    (tmp_path / name).unlink()
    before = bytes_of(tmp_path)
    with pytest.raises(FolderError, match=f"{name}: missing"):
        open_colony_folder(tmp_path, "launch", small(), None)
    assert bytes_of(tmp_path) == before


def test_a_robot_that_lost_its_key_or_its_file_is_named(tmp_path: Path) -> None:
    """It would be another robot; one that has not lived yet has neither."""
    with open_colony_folder(tmp_path, "launch", small(), None) as folder:
        own = folder.prepare_robot(1)
    open_colony_folder(tmp_path, "launch", small(), None).__exit__()
    (own / "robot.sqlite").touch()
    with pytest.raises(FolderError, match="robots/1/key: missing"):
        open_colony_folder(tmp_path, "launch", small(), None)
    (own / "robot.sqlite").rename(own / "robot.sqlite.lock")
    with pytest.raises(FolderError, match=r"robots/1/robot\.sqlite: missing"):
        open_colony_folder(tmp_path, "launch", small(), None)


def test_the_checkpoint_that_an_earlier_version_wrote_is_given_to_the_arena(tmp_path: Path) -> None:
    """It was in the folder of the colony."""
    for name in ("logs", "robots"):
        (tmp_path / name).mkdir()
    (tmp_path / "arena.npz").write_bytes(b"checkpoint")
    (tmp_path / "config.toml").write_text("generations = 3\nrobots = 4\n")
    with open_colony_folder(tmp_path, "launch", load(None, ["generations=3"]), None) as folder:
        arena = folder.prepare_arena()
        assert (arena / "arena.npz").read_bytes() == b"checkpoint"
        assert folder.prepare_arena() == arena
    assert not (tmp_path / "arena.npz").exists()


def test_a_colony_that_cannot_be_started_leaves_nothing_behind(
    tmp_path: Path, beginning: Beginning, monkeypatch: pytest.MonkeyPatch
) -> None:
    """When the disk is full in the middle."""

    def fail(*_: object) -> None:
        raise OSError(28, os.strerror(28))

    monkeypatch.setattr("crcolony.storage.founders_file.write_checkpoint", fail)
    with pytest.raises(FolderError, match="No space left"):
        open_colony_folder(tmp_path / "run", "launch", small(), beginning)
    assert not (tmp_path / "run").exists()
