"""`crcolony backup` says what it has copied, and that it holds secrets."""

from pathlib import Path

import pytest

from crcolony.cli import main
from tests.support.backed_up_robots import make_robot
from tests.support.command_line import refusal


def test_it_prints_every_robot_and_warns_of_the_keys(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """And without keys there is nothing to warn of."""
    identity = make_robot(tmp_path / "robot")
    words = ["backup", str(tmp_path / "robot"), "--to"]
    assert main([*words, str(tmp_path / "b.tar")]) == 0
    first, second, third = capsys.readouterr().out.splitlines()
    assert first == f"robot {identity.id.hex()[:8]} in .: 3 encounters, tick 77, with its key"
    assert second.startswith(f"{tmp_path}/b.tar: 1 robots, ")
    assert "secret keys" in third
    assert main([*words, str(tmp_path / "c.tar"), "--without-keys"]) == 0
    assert "secret" not in capsys.readouterr().out


def test_what_is_wrong_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """With the folder and the reason."""
    line = refusal(capsys, "backup", tmp_path, "--to", tmp_path / "b.tar")
    assert line == f"crcolony: {tmp_path}: no robot's folder is there"


def test_a_week_of_backups_is_kept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What is deleted is said; a number that keeps none, and a file, are refused."""
    make_robot(tmp_path / "robot")
    (tmp_path / "backups").mkdir()
    old = tmp_path / "backups/crcolony-20250101T000000Z.tar.gz"
    old.write_text("")
    words = ["backup", str(tmp_path / "robot"), "--to", str(tmp_path / "backups"), "--keep"]
    assert main([*words, "1"]) == 0
    assert f"{old}: deleted, --keep 1" in capsys.readouterr().out
    assert len(list((tmp_path / "backups").iterdir())) == 1
    assert "must be at least 1" in refusal(capsys, *words, "0")
    assert "--keep needs a folder" in refusal(capsys, *words[:3], tmp_path / "b.tar", "--keep", "1")
