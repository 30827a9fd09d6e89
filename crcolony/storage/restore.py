"""Restores a backup into a new folder, which is there only when every file of it has been checked."""

import contextlib
import os
import shutil
import tarfile
import tempfile
import time
import zlib
from collections.abc import Iterator
from pathlib import Path, PurePosixPath
from typing import IO

from crcolony.durable_files import sync_folder
from crcolony.protocol.identity import load_key
from crcolony.storage.backup_manifest import (
    MANIFEST,
    MAX_MANIFEST_BYTES,
    ROBOT_FILES,
    SECRET_FILES,
    BackedUpFile,
    BackupError,
    Manifest,
    decode_manifest,
    digest_of_file,
)
from crcolony.storage.files import KEY_FILE
from crcolony.storage.robot_copy import check_robot_file

_CLOCK_TOLERANCE_S = 5


def restore_backup(archive: Path, folder: Path) -> Manifest:
    """Write what is in a backup into a folder that is new or empty; return its list.

    As root its files are given to the owner of the folder in which it is made. Raises BackupError, StorageError and
    IdentityError, and leaves nothing then.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise BackupError(f"{folder}: not empty; a restore never overwrites: choose another --out")
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".crcolony-restore-", dir=folder.parent) as scratch:
            draft = Path(scratch) / "files"
            draft.mkdir(mode=0o755)
            manifest = _extract(archive, draft)
            _check_robots(archive, draft, manifest)
            _give_to_owner(draft, folder.parent)
            if folder.exists():
                folder.rmdir()
            draft.rename(folder)
            sync_folder(folder.parent)
    except OSError as error:
        what = error.filename if error.filename is not None else folder
        raise BackupError(f"{what}: not restored: {error.strerror}") from None
    return manifest


def read_manifest(archive: Path) -> Manifest:
    """Return the list of a backup without restoring it; raises BackupError."""
    with _opened(archive) as tar:
        return _manifest_of(archive, tar)


def _opened(archive: Path) -> tarfile.TarFile:
    try:
        return tarfile.open(archive, "r:*")
    except OSError as error:
        raise BackupError(f"{archive}: cannot be read: {error.strerror}") from None
    except (tarfile.TarError, EOFError, ValueError):
        raise BackupError(f"{archive}: not a backup: neither tar nor tar.gz") from None


def _manifest_of(archive: Path, tar: tarfile.TarFile) -> Manifest:
    with _damage_named(archive):
        member = tar.next()
        if member is None or member.name != MANIFEST or member.size > MAX_MANIFEST_BYTES:
            raise BackupError(f"{archive}: not a backup: {MANIFEST} is not its first file")
        manifest = decode_manifest(_content(archive, tar, member).read(), archive)
    if manifest.unix_s > time.time() + _CLOCK_TOLERANCE_S:
        raise BackupError(
            f"{archive}: made in the future: set this machine's clock first, or what the robot"
            " does from now on counts as older than what it did"
        )
    return manifest


def _extract(archive: Path, folder: Path) -> Manifest:
    with _opened(archive) as tar, _damage_named(archive):
        manifest = _manifest_of(archive, tar)
        listed = {file.path: file for file in manifest.files}
        while (member := tar.next()) is not None:
            file = listed.pop(member.name, None)
            if file is None:
                raise BackupError(f"{archive}: refused: {member.name!r} is not in its list")
            _extract_file(archive, tar, member, folder, file)
        if listed:
            raise BackupError(f"{archive}: damaged: {min(listed)} is missing")
    return manifest


def _extract_file(
    archive: Path, tar: tarfile.TarFile, member: tarfile.TarInfo, folder: Path, file: BackedUpFile
) -> None:
    if member.size != file.size_bytes:
        raise BackupError(f"{archive}: damaged: {file.path} has another size than is listed")
    target = folder / PurePosixPath(file.path)
    target.parent.mkdir(parents=True, exist_ok=True)
    is_secret = target.name in SECRET_FILES
    descriptor = os.open(target, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o600 if is_secret else 0o644)
    with os.fdopen(descriptor, "w+b") as copy:
        shutil.copyfileobj(_content(archive, tar, member), copy)
        copy.flush()
        os.fsync(copy.fileno())
        copy.seek(0)
        if digest_of_file(copy) != file.digest:
            raise BackupError(f"{archive}: damaged: {file.path} is not what was backed up")


def _content(archive: Path, tar: tarfile.TarFile, member: tarfile.TarInfo) -> IO[bytes]:
    content = tar.extractfile(member) if member.isreg() else None
    if content is None:
        raise BackupError(f"{archive}: refused: {member.name!r} is not a plain file")
    return content


@contextlib.contextmanager
def _damage_named(archive: Path) -> Iterator[None]:
    """Raise BackupError, naming the archive, in place of what tarfile and zlib raise for damaged bytes."""
    try:
        yield
    except (tarfile.TarError, EOFError, zlib.error) as error:
        raise BackupError(f"{archive}: damaged: {error}") from None
    except OSError as error:
        if error.errno is not None:
            raise
        raise BackupError(f"{archive}: damaged: {error}") from None  # gzip's own


def _check_robots(archive: Path, folder: Path, manifest: Manifest) -> None:
    """Check every robot's file, and that the key beside it is its own."""
    files = {f.path for f in manifest.files if PurePosixPath(f.path).name in ROBOT_FILES}
    for robot in manifest.robots:
        own = PurePosixPath(robot.folder)
        path = next((str(own / n) for n in ROBOT_FILES if str(own / n) in files), None)
        if path is None:
            raise BackupError(f"{archive}: damaged: the file of robot {robot.id[:8]} is missing")
        files.discard(path)
        if check_robot_file(folder / path).id != robot.id:
            raise BackupError(f"{archive}: damaged: {path} is not of robot {robot.id[:8]}")
        key = folder / own / KEY_FILE
        if key.exists() and load_key(key).id.hex() != robot.id:
            raise BackupError(f"{archive}: {own / KEY_FILE} is not the key of robot {robot.id[:8]}")
    if files:
        raise BackupError(f"{archive}: damaged: nothing says whose file {min(files)} is")


def _give_to_owner(draft: Path, parent: Path) -> None:
    if os.geteuid() != 0:
        return
    owner = parent.stat()
    for path in (draft, *draft.rglob("*")):
        os.chown(path, owner.st_uid, owner.st_gid, follow_symlinks=False)
