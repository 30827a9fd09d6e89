"""A folder says what made it, and folders of earlier versions show it."""

from pathlib import Path

import pytest

from crcolony.storage.files import FolderError
from crcolony.storage.folder_record import (
    FolderRecord,
    Maker,
    Origin,
    check_config_digest,
    config_digest,
    maker_of,
    read_record,
    write_record,
)


def test_a_record_is_read_as_it_was_written(tmp_path: Path) -> None:
    """With its origin, which a person can read too."""
    record = FolderRecord("launch", "ab", Origin("/runs/1", 250, "9f3a"))
    write_record(tmp_path, record)
    assert read_record(tmp_path) == record
    assert 'run = "/runs/1"' in (tmp_path / "made_by.toml").read_text()
    assert maker_of(tmp_path) == "launch"


def test_a_folder_without_a_record_has_none(tmp_path: Path) -> None:
    """Nor has what is no folder."""
    (tmp_path / "file").touch()
    for place in (tmp_path, tmp_path / "missing", tmp_path / "file"):
        assert read_record(place) is None
        assert maker_of(place) is None


@pytest.mark.parametrize("content", ["made_by = 'nobody'", "made_by =", "", "made_by = 3"])
def test_a_damaged_record_is_named(tmp_path: Path, content: str) -> None:
    """It does not count as missing: the folder would be taken for that of an earlier version."""
    (tmp_path / "made_by.toml").write_text(content)
    with pytest.raises(FolderError, match=r"made_by\.toml: corrupt"):
        maker_of(tmp_path)


@pytest.mark.parametrize(
    ("files", "maker"),
    [
        ("config.toml run.json history.sqlite checkpoint.npz generations.csv", "evolve"),
        ("config.toml history.sqlite-wal history.sqlite", "evolve"),
        ("implicit/seed-1/config.toml", "evolve --seeds"),
        ("outcomes.csv implicit/seed-1/config.toml", "evolve --seeds"),
        ("experiment.json jobs.jsonl", "experiment"),
        ("config.toml robots/0/key logs/arena.log arena.npz history.sqlite run.json", "launch"),
        ("config.toml robots/0/robot.sqlite arena.npz", "host"),
        ("config.toml robots/0/key telemetry.sqlite dashboard.rrd logs/dashboard.log", "launch"),
        ("key robot.sqlite robot.sqlite.lock", "robot"),
        ("memory.sqlite", "robot"),
        ("key", "robot"),
        ("arena.npz", "arena"),
        ("telemetry.sqlite dashboard.rrd", "dashboard"),
        ("config.toml thesis.tex", None),
    ],
)
def test_the_folder_of_an_earlier_version_is_known_by_its_files(
    tmp_path: Path, files: str, maker: Maker | None
) -> None:
    """Which no other command writes."""
    for name in files.split():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    assert maker_of(tmp_path) == maker


def test_a_config_that_was_changed_or_is_missing_is_named(tmp_path: Path) -> None:
    """A folder of an earlier version has no digest, and passes."""
    config = tmp_path / "config.toml"
    with pytest.raises(FolderError, match=r"config\.toml: missing"):
        check_config_digest(tmp_path)
    config.write_text("seed = 1\n")
    check_config_digest(tmp_path)
    write_record(tmp_path, FolderRecord("evolve", config_digest(config.read_text())))
    config.write_text("# a finished run goes on\nseed = 1\ngenerations = 500\n")
    check_config_digest(tmp_path)
    config.write_text("seed = 2\n")
    with pytest.raises(FolderError, match=r"config\.toml: changed since"):
        check_config_digest(tmp_path)
    config.write_text("seed =\n")
    with pytest.raises(FolderError, match=r"config\.toml: corrupt"):
        check_config_digest(tmp_path)
