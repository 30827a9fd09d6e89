"""The folder of a run is found by the keys of its robots, and by nothing else."""

import os
from pathlib import Path

from crcolony.protocol.identity import create_key
from crcolony.recordings.run_of_robots import run_of_robots


def make_run(folder: Path, robots: int = 2) -> list[bytes]:
    """Make a results folder with robots; return their ids."""
    made = []
    for number in range(robots):
        own = folder / "robots" / str(number)
        own.mkdir(parents=True)
        made.append(create_key(own / "key").id)
    return made


def test_the_folder_that_holds_a_robots_key_is_found(tmp_path: Path) -> None:
    """One of its robots is enough."""
    ids = {name: make_run(tmp_path / name) for name in ("1", "2", "3")}
    assert run_of_robots([ids["2"][1]], tmp_path) == tmp_path / "2"
    assert run_of_robots([b"elsewhere" * 2, ids["3"][0]], tmp_path) == tmp_path / "3"


def test_robots_of_another_machine_have_no_folder_here(tmp_path: Path) -> None:
    """Neither in a folder without runs, nor beside other files and unreadable keys."""
    assert run_of_robots([b"x" * 16], tmp_path / "runs") is None
    make_run(tmp_path / "1")
    (tmp_path / "notes.txt").write_text("x")
    (tmp_path / "2" / "robots" / "0").mkdir(parents=True)
    (tmp_path / "2" / "robots" / "0" / "key").write_text("no key")
    assert run_of_robots([b"x" * 16], tmp_path) is None


def test_of_two_copies_the_newest_is_found(tmp_path: Path) -> None:
    """A copied folder has the same keys."""
    (robot, _) = make_run(tmp_path / "old")
    key = tmp_path / "new" / "robots" / "0" / "key"
    key.parent.mkdir(parents=True)
    key.write_bytes((tmp_path / "old" / "robots" / "0" / "key").read_bytes())
    key.chmod(0o600)
    os.utime(tmp_path / "old", (1e9, 1e9))
    assert run_of_robots([robot], tmp_path) == tmp_path / "new"
