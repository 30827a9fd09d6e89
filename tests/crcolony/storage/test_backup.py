"""A backup holds what robots cannot get back, is there whole or not at all, and is for its owner's eyes alone."""

import tarfile
from pathlib import Path

import pytest

from crcolony.storage.backup import delete_old_backups, make_backup
from crcolony.storage.backup_manifest import BackupError
from crcolony.storage.restore import read_manifest
from crcolony.storage.sql import StorageError
from tests.support.backed_up_robots import make_robot, open_robot
from tests.support.robot_stores import mate, room_for


def names_in(archive: Path) -> list[str]:
    """Return the names of all files in an archive, in order."""
    with tarfile.open(archive) as tar:
        return tar.getnames()


def left_in(folder: Path) -> list[str]:
    """Return what is in a folder besides the robot's own."""
    return sorted(path.name for path in folder.iterdir() if path.name != "robot")


@pytest.mark.parametrize("name", ["backup.tar", "backup.tar.gz", "backup.tgz"])
def test_a_robots_folder_is_backed_up_while_it_runs(tmp_path: Path, name: str) -> None:
    """Its file, its key and what made it; not its logs, nor what somebody has put there."""
    identity = make_robot(tmp_path / "robot")
    (tmp_path / "robot/notes.txt").write_text("mine")
    store = open_robot(tmp_path / "robot", identity)
    mate(store, 40)
    archive, manifest = make_backup([tmp_path / "robot"], tmp_path / name, has_keys=True)
    store.close()
    assert names_in(archive) == ["backup.json", "key", "made_by.toml", "robot.sqlite"]
    (robot,) = manifest.robots
    assert (robot.folder, robot.id, robot.encounters, robot.has_key) == (
        ".", identity.id.hex(), 4, True,
    )  # fmt: skip
    assert read_manifest(archive) == manifest
    assert archive.stat().st_mode & 0o777 == 0o600
    assert left_in(tmp_path) == [name]


def test_a_backup_without_keys_holds_none(tmp_path: Path) -> None:
    """For those who keep keys elsewhere."""
    make_robot(tmp_path / "robot")
    archive, manifest = make_backup([tmp_path / "robot"], tmp_path / "b.tar", has_keys=False)
    assert names_in(archive) == ["backup.json", "made_by.toml", "robot.sqlite"]
    assert not manifest.robots[0].has_key
    secret = (tmp_path / "robot/key").read_bytes().strip()
    assert secret not in archive.read_bytes()


def test_all_robots_of_a_colony_are_found_with_what_they_share(tmp_path: Path) -> None:
    """Whatever the folders between; the archive is called by the time if a folder is named for it."""
    ids = [make_robot(tmp_path / f"robot/robots/{number}").id.hex() for number in range(3)]
    (tmp_path / "robot/config.toml").write_text("seed = 1\n")
    (tmp_path / "robot/logs").mkdir()
    (tmp_path / "robot/logs/robot-0.log").write_text("a line")
    (tmp_path / "backups").mkdir()
    archive, manifest = make_backup([tmp_path / "robot"], tmp_path / "backups", has_keys=True)
    assert archive.parent == tmp_path / "backups"
    assert archive.name.startswith("crcolony-2")
    assert {robot.folder: robot.id for robot in manifest.robots} == {
        f"robots/{number}": id_ for number, id_ in enumerate(ids)
    }
    assert "config.toml" in names_in(archive)
    assert not any("log" in name for name in names_in(archive))


def test_of_several_folders_each_has_its_place(tmp_path: Path) -> None:
    """Two of one name are refused: one would be in the other's place."""
    for folder in ("a/one", "a/two", "b/one"):
        make_robot(tmp_path / folder)
    folders = [tmp_path / "a/one", tmp_path / "a/two"]
    _, manifest = make_backup(folders, tmp_path / "b.tar", has_keys=True)
    assert [robot.folder for robot in manifest.robots] == ["one", "two"]
    with pytest.raises(BackupError, match="another folder has the same name"):
        make_backup([*folders, tmp_path / "b/one"], tmp_path / "c.tar", has_keys=True)


def test_a_backup_in_the_folder_that_is_backed_up_does_not_hold_itself(tmp_path: Path) -> None:
    """Nor what is being made there."""
    make_robot(tmp_path / "robot")
    first, _ = make_backup([tmp_path], tmp_path / "first.tar", has_keys=True)
    second, _ = make_backup([tmp_path], tmp_path / "second.tar", has_keys=True)
    assert names_in(first) == names_in(second)
    assert left_in(tmp_path) == ["first.tar", "second.tar"]


def test_a_link_is_not_followed(tmp_path: Path) -> None:
    """Whoever may write into a robot's folder must not read files of others through a backup made by root."""
    make_robot(tmp_path / "robot")
    (tmp_path / "secret").write_text("of root")
    (tmp_path / "robot/config.toml").symlink_to(tmp_path / "secret")
    archive, _ = make_backup([tmp_path / "robot"], tmp_path / "b.tar", has_keys=True)
    assert "config.toml" not in names_in(archive)


def test_what_cannot_be_backed_up_is_said_and_leaves_nothing(tmp_path: Path) -> None:
    """A folder without robots, one that is missing, a file; an archive that exists, or has no place."""
    make_robot(tmp_path / "robot")
    (tmp_path / "empty").mkdir()
    (tmp_path / "there.tar").write_text("another backup")
    for folder, target, reason in (
        ("empty", "b.tar", "no robot's folder is there"),
        ("missing", "b.tar", "there is no such folder"),
        ("robot/key", "b.tar", "not a folder"),
        ("robot", "there.tar", "exists already"),
        ("robot", "no/b.tar", "there is no folder"),
        ("robot", "b.zip", "must be a folder, or end in .tar"),
    ):
        with pytest.raises(BackupError, match=reason):
            make_backup([tmp_path / folder], tmp_path / target, has_keys=True)
    assert left_in(tmp_path) == ["empty", "there.tar"]
    assert (tmp_path / "there.tar").read_text() == "another backup"


def test_one_damaged_robot_fails_the_whole_backup(tmp_path: Path) -> None:
    """And names it: a backup that silently lacks a robot is none."""
    make_robot(tmp_path / "robot/robots/0")
    make_robot(tmp_path / "robot/robots/1")
    path = tmp_path / "robot/robots/1/robot.sqlite"
    data = bytearray(path.read_bytes())
    data[data.index(b"a letter")] ^= 1
    path.write_bytes(data)
    with pytest.raises(StorageError, match=r"robots/1/robot\.sqlite: corrupt"):
        make_backup([tmp_path / "robot"], tmp_path / "b.tar", has_keys=True)
    assert left_in(tmp_path) == []


def test_a_full_disk_leaves_nothing(tmp_path: Path) -> None:
    """At any moment of it: one line, and the room is free again."""
    make_robot(tmp_path / "robot", encounters=40)
    size = (tmp_path / "robot/robot.sqlite").stat().st_size
    for room in (0, 100, 9_000, size - 1, size + 1000):  # for the copy, and for the archive
        with room_for(room), pytest.raises((BackupError, StorageError)):
            make_backup([tmp_path / "robot"], tmp_path / "b.tar", has_keys=True)
        assert left_in(tmp_path) == []


def test_old_backups_are_deleted_and_nothing_else(tmp_path: Path) -> None:
    """The newest stay, and archives that a person has named, and those that are only called alike."""
    named = [f"crcolony-2026010{day}T000000Z.tar.gz" for day in range(1, 8)]
    others = ["crcolony-mine.tar.gz", "robot.tar", "crcolony-20250101T000000Z.tar.gz.asc"]
    for name in (*named, *others):
        (tmp_path / name).write_text("")
    deleted = delete_old_backups(tmp_path, keep=3)
    assert [path.name for path in deleted] == named[:4]
    assert left_in(tmp_path) == sorted([*named[4:], *others])
    assert delete_old_backups(tmp_path, keep=3) == []
