"""A backup is restored whole or not at all, over nothing, and whatever is in the archive stays in its folder."""

import io
import json
import os
import shutil
import tarfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from crcolony.protocol.identity import IdentityError, load_key
from crcolony.storage.backup import make_backup
from crcolony.storage.backup_manifest import BackupError
from crcolony.storage.reading import StoredRobot, read_stored_robot
from crcolony.storage.restore import restore_backup
from crcolony.storage.sql import StorageError
from tests.support.backed_up_robots import make_robot, open_robot, repack
from tests.support.robot_stores import room_for


@pytest.fixture
def archive(tmp_path: Path) -> Path:
    """The backup of a robot with forty encounters."""
    make_robot(tmp_path / "robot", encounters=40)
    return make_backup([tmp_path / "robot"], tmp_path / "backup.tar", has_keys=True)[0]


def content(folder: Path) -> StoredRobot:
    """Return all that a robot's file holds, without its pool, whose arrays cannot be compared."""
    return replace(read_stored_robot(folder / "robot.sqlite"), pool=[])


def left_in(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()} - {"robot", "backup.tar", "changed.tar"}


def test_what_was_backed_up_is_restored(tmp_path: Path, archive: Path) -> None:
    """The robot goes on from there: with its key, its encounters and a later incarnation."""
    restore_backup(archive, tmp_path / "deep/restored")
    identity = load_key(tmp_path / "deep/restored/key")
    assert (tmp_path / "deep/restored/key").stat().st_mode & 0o777 == 0o600
    before, after = content(tmp_path / "robot"), content(tmp_path / "deep/restored")
    assert after == before
    assert len(after.matings) == 40
    store = open_robot(tmp_path / "deep/restored", identity)
    assert store.begin_incarnation(int(time.time())) > before.incarnation
    store.close()


def test_files_belong_to_the_owner_of_the_folder_around(tmp_path: Path, archive: Path) -> None:
    """Root restores what a service of another user will open."""
    if os.geteuid() != 0:
        pytest.skip("only root can give files away")
    (tmp_path / "state").mkdir()
    os.chown(tmp_path / "state", 1234, 1235)
    restore_backup(archive, tmp_path / "state/robot")
    for path in (tmp_path / "state/robot", *(tmp_path / "state/robot").rglob("*")):
        assert (path.stat().st_uid, path.stat().st_gid) == (1234, 1235)


def test_nothing_is_overwritten(tmp_path: Path, archive: Path) -> None:
    """A folder with anything in it, or a file; an empty folder is filled."""
    for name in ("robot", "backup.tar"):
        with pytest.raises(BackupError, match="a restore never overwrites"):
            restore_backup(archive, tmp_path / name)
    (tmp_path / "empty").mkdir()
    restore_backup(archive, tmp_path / "empty")
    assert (tmp_path / "empty/robot.sqlite").exists()


def manifest_of(archive: Path) -> dict[str, Any]:
    with tarfile.open(archive) as tar:
        content = tar.extractfile("backup.json")
        assert content is not None
        listed: dict[str, Any] = json.load(content)
        return listed


def refused(archive: Path, tmp_path: Path, reason: str) -> None:
    """Restore it, which must fail for this reason and leave nothing."""
    with pytest.raises((BackupError, StorageError, IdentityError), match=reason) as error:
        restore_backup(archive, tmp_path / "restored")
    assert "\n" not in str(error.value)
    assert left_in(tmp_path) == set()


def test_every_flipped_byte_is_found(tmp_path: Path, archive: Path) -> None:
    """In the list, in a header, or in a file: each is refused in one line, or changes nothing that is restored."""
    data = archive.read_bytes()
    for place in (*range(0, 4096, 97), *range(4096, len(data), 1499)):
        changed = bytearray(data)
        changed[place] ^= 0x55
        (tmp_path / "changed.tar").write_bytes(changed)
        if reason := failure(tmp_path / "changed.tar", tmp_path / "restored"):
            assert "\n" not in reason
            assert left_in(tmp_path) == set()
            continue
        assert content(tmp_path / "restored") == content(tmp_path / "robot")
        shutil.rmtree(tmp_path / "restored")


def failure(archive: Path, folder: Path) -> str:
    """Restore an archive; return why that failed, or nothing."""
    try:
        restore_backup(archive, folder)
    except (BackupError, StorageError, IdentityError) as error:
        return str(error)
    return ""


@pytest.mark.parametrize("name", ["backup.tar", "backup.tar.gz"])
def test_a_cut_archive_is_refused(tmp_path: Path, archive: Path, name: str) -> None:
    """As after a copy over a network that broke off, compressed or not."""
    if name != archive.name:
        archive = make_backup([tmp_path / "robot"], tmp_path / name, has_keys=True)[0]
    data = archive.read_bytes()
    archive.rename(tmp_path / "changed.tar")
    almost = len(data) - (20_000 if name == "backup.tar" else 500)
    for length in (0, 1, 100, 512, 1024, 5000, len(data) // 2, almost):
        (tmp_path / "changed.tar").write_bytes(data[:length])
        refused(tmp_path / "changed.tar", tmp_path, "damaged|not a backup")


@pytest.mark.parametrize(
    "path", ["../key", "/tmp/key", "a/../../key", "./key", "a//key", "notes.txt", "key/", "a\\key", "\x1bkey/key"]
)  # fmt: skip
def test_no_path_leads_out_of_the_folder(tmp_path: Path, archive: Path, path: str) -> None:
    """Nor to a file of another kind than a robot has, listed or not."""
    listed = manifest_of(archive)
    key = next(file for file in listed["files"] if file["path"] == "key")
    header = tarfile.TarInfo(path)
    changed = repack(archive, tmp_path / "changed.tar", (path, header, b"evil"))
    refused(changed, tmp_path, "refused: .* is not in its list")
    key["path"] = path
    entry = ("backup.json", tarfile.TarInfo("backup.json"), json.dumps(listed).encode())
    refused(repack(archive, tmp_path / "changed.tar", entry), tmp_path, "is no file of a robot")


@pytest.mark.parametrize(
    "kind", [tarfile.SYMTYPE, tarfile.LNKTYPE, tarfile.FIFOTYPE, tarfile.DIRTYPE, tarfile.CHRTYPE]
)
def test_only_plain_files_are_restored(tmp_path: Path, archive: Path, kind: bytes) -> None:
    """No link that a later file would be written through, no device."""
    header = tarfile.TarInfo("key")
    header.type, header.linkname = kind, "/etc/passwd"
    changed = repack(archive, tmp_path / "changed.tar", ("key", header, b""))
    refused(changed, tmp_path, "key")


def changed_list(tmp_path: Path, archive: Path, **changes: Any) -> Path:
    content = json.dumps(manifest_of(archive) | changes).encode()
    entry = ("backup.json", tarfile.TarInfo("backup.json"), content)
    return repack(archive, tmp_path / "changed.tar", entry)


def test_a_file_that_is_missing_is_named(tmp_path: Path, archive: Path) -> None:
    """And one that is there twice, or belongs to nobody."""
    refused(
        repack(archive, tmp_path / "changed.tar", ("key", None, b"")), tmp_path, "key is missing"
    )
    files = manifest_of(archive)["files"]
    refused(changed_list(tmp_path, archive, files=[*files, files[0]]), tmp_path, "listed twice")
    refused(changed_list(tmp_path, archive, robots=[]), tmp_path, "nothing says whose")


def test_a_robot_with_a_file_or_a_key_of_another_is_refused(tmp_path: Path, archive: Path) -> None:
    """Its list says one robot, its file another."""
    (robot,) = manifest_of(archive)["robots"]
    other = [robot | {"id": "ab" * 16}]
    refused(changed_list(tmp_path, archive, robots=other), tmp_path, "is not of robot abababab")
    elsewhere = [robot | {"folder": "../robot"}]
    refused(changed_list(tmp_path, archive, robots=elsewhere), tmp_path, "is missing")
    (tmp_path / "robot/key").write_text("12" * 32)
    archive.unlink()
    archive = make_backup([tmp_path / "robot"], archive, has_keys=True)[0]
    refused(archive, tmp_path, "key is not the key of robot")


def test_a_backup_of_the_future_is_refused(tmp_path: Path, archive: Path) -> None:
    """On a machine whose clock is behind, the next incarnation would be below those that were lost."""
    future = changed_list(tmp_path, archive, unix_s=int(time.time()) + 3600)
    refused(future, tmp_path, "made in the future: set this machine's clock first")


def test_what_is_no_backup_is_refused(tmp_path: Path, archive: Path) -> None:
    """A missing file, a folder, a text, an archive of something else, one of a later version."""
    refused(tmp_path / "missing", tmp_path, "No such file")
    refused(tmp_path / "robot", tmp_path, "Is a directory")
    (tmp_path / "changed.tar").write_text("a text")
    refused(tmp_path / "changed.tar", tmp_path, "not a backup")
    with tarfile.open(tmp_path / "changed.tar", "w") as tar:
        tar.addfile(tarfile.TarInfo("photo.jpg"), io.BytesIO())
    refused(tmp_path / "changed.tar", tmp_path, "not a backup")
    refused(changed_list(tmp_path, archive, format=2), tmp_path, "of format 2, not 1: update")
    refused(changed_list(tmp_path, archive, unix_s="now"), tmp_path, "damaged: backup.json")


def test_a_full_disk_leaves_nothing(tmp_path: Path, archive: Path) -> None:
    """One line, and the room is free again."""
    size = (tmp_path / "robot/robot.sqlite").stat().st_size
    for room in (0, 50, 9_000, size - 1):
        with room_for(room):
            refused(archive, tmp_path, "not restored: ")
