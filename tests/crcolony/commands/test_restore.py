"""`crcolony restore` says what it has restored, and what a person must be sure of before the robot starts."""

from pathlib import Path

import pytest

from crcolony.cli import main
from tests.support.backed_up_robots import make_robot
from tests.support.command_line import refusal


def test_it_prints_every_robot_and_that_two_copies_must_not_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Where there is no key it says where to put it."""
    make_robot(tmp_path / "robot")
    for options, says in (([], "tick 77\n"), (["--without-keys"], f"put it at {tmp_path}/two/key")):
        archive, folder = tmp_path / f"{len(options)}.tar", tmp_path / ("two" if options else "one")
        main(["backup", str(tmp_path / "robot"), "--to", str(archive), *options])
        capsys.readouterr()
        assert main(["restore", str(archive), "--out", str(folder)]) == 0
        printed = capsys.readouterr().out
        assert says in printed
        assert "two copies of one robot must never run" in printed


def test_what_is_wrong_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """With the archive and the reason."""
    line = refusal(capsys, "restore", tmp_path / "missing", "--out", tmp_path / "robot")
    assert line == f"crcolony: {tmp_path}/missing: cannot be read: No such file or directory"
