"""Makes a backup of robots' folders while their robots run, as one tar archive that is there whole or not at all."""

import io
import os
import re
import shutil
import tarfile
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path, PurePosixPath

import msgspec

from crcolony.durable_files import sync_folder
from crcolony.storage.backup_manifest import (
    FORMAT,
    MANIFEST,
    PLAIN_FILES,
    ROBOT_FILES,
    SECRET_FILES,
    BackedUpFile,
    BackedUpRobot,
    BackupError,
    Manifest,
    digest_of_file,
)
from crcolony.storage.files import KEY_FILE
from crcolony.storage.robot_copy import CopiedRobot, copy_robot_file

SCRATCH = ".crcolony-backup-"
"""The beginning of a folder's name in which a backup is made, beside its archive."""
_BY_TIME = re.compile(r"crcolony-\d{8}T\d{6}Z\.tar\.gz")
_SUFFIXES = (".tar", ".tar.gz", ".tgz")


def make_backup(folders: Sequence[Path], target: Path, has_keys: bool) -> tuple[Path, Manifest]:
    """Write what is in folders of robots into an archive; return its path, and what is in it.

    If `target` is a folder the archive gets the name of the moment. Of several folders each is a folder in it. It is
    readable for its owner alone. Raises BackupError and StorageError, and leaves nothing then.
    """
    archive = _archive_path(target)
    unix_s = int(time.time())
    try:
        with tempfile.TemporaryDirectory(prefix=SCRATCH, dir=archive.parent) as scratch:
            copies = Path(scratch) / "files"
            robots = [
                robot
                for folder, prefix in _named(folders)
                for robot in _copy_folder(folder, copies / prefix, prefix, has_keys)
            ]
            if not robots:
                raise BackupError(f"{', '.join(map(str, folders))}: no robot's folder is there")
            manifest = Manifest(FORMAT, unix_s, _list_files(copies), robots)
            draft = Path(scratch) / "archive"
            _write_archive(draft, archive.name, copies, manifest)
            _publish(draft, archive)
    except OSError as error:
        what = error.filename if error.filename is not None else archive
        raise BackupError(f"{what}: not backed up: {error.strerror}") from None
    return archive, manifest


def delete_old_backups(folder: Path, keep: int) -> list[Path]:
    """Delete all but the newest archives that are called by the time in a folder; return them. Raises BackupError."""
    old = sorted(path for path in folder.iterdir() if _BY_TIME.fullmatch(path.name))[:-keep]
    for path in old:
        try:
            path.unlink()
        except OSError as error:
            raise BackupError(f"{path}: not deleted: {error.strerror}") from None
    return old


def _archive_path(target: Path) -> Path:
    if target.is_dir():
        now = time.strftime("%Y%m%dT%H%M%SZ", time.gmtime())
        return target / f"crcolony-{now}.tar.gz"
    if not target.name.endswith(_SUFFIXES):
        raise BackupError(f"{target}: must be a folder, or end in {', '.join(_SUFFIXES)}")
    if not target.parent.is_dir():
        raise BackupError(f"{target}: there is no folder {target.parent}")
    if target.exists():
        raise BackupError(f"{target}: exists already; a backup is never overwritten")
    return target


def _named(folders: Sequence[Path]) -> Iterator[tuple[Path, str]]:
    """Yield every folder with its place in the archive: one alone is its root."""
    names = [folder.resolve().name for folder in folders]
    for folder, name in zip(folders, names, strict=True):
        if not folder.is_dir():
            reason = "not a folder" if folder.exists() else "there is no such folder"
            raise BackupError(f"{folder}: {reason}")
        if len(folders) > 1 and (names.count(name) > 1 or not name):
            raise BackupError(f"{folder}: another folder has the same name; back them up apart")
        yield folder, name if len(folders) > 1 else "."


def _copy_folder(
    folder: Path, copies: Path, prefix: str, has_keys: bool
) -> Iterator[BackedUpRobot]:
    """Copy what belongs into a backup from a folder and those in it; yield every robot that was found."""
    for path, inner, names in os.walk(folder, onerror=_raise):
        inner[:] = [name for name in inner if not name.startswith(SCRATCH)]
        source = Path(path)
        target = copies / source.relative_to(folder)
        place = PurePosixPath(prefix) / source.relative_to(folder).as_posix()
        wanted = (*PLAIN_FILES, *SECRET_FILES) if has_keys else PLAIN_FILES
        for name in wanted:
            if name in names and (source / name).is_file() and not (source / name).is_symlink():
                target.mkdir(parents=True, exist_ok=True)
                _copy_file(source / name, target / name)
        for name in ROBOT_FILES:
            if name in names:
                target.mkdir(parents=True, exist_ok=True)
                copied = copy_robot_file(source / name, target / name)
                yield _robot(str(place), copied, (target / KEY_FILE).exists())
                break


def _raise(error: OSError) -> None:
    raise error


def _robot(place: str, copied: CopiedRobot, has_key: bool) -> BackedUpRobot:
    return BackedUpRobot(
        place, copied.id, copied.incarnation, copied.encounters, copied.tick, has_key
    )


def _copy_file(source: Path, target: Path) -> None:
    descriptor = os.open(target, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    with source.open("rb") as original, os.fdopen(descriptor, "wb") as copy:
        shutil.copyfileobj(original, copy)


def _list_files(copies: Path) -> list[BackedUpFile]:
    listed = []
    for path in sorted(path for path in copies.rglob("*") if path.is_file()):
        with path.open("rb") as file:
            digest = digest_of_file(file)
        name = path.relative_to(copies).as_posix()
        listed.append(BackedUpFile(name, path.stat().st_size, digest))
    return listed


def _write_archive(draft: Path, name: str, copies: Path, manifest: Manifest) -> None:
    content = msgspec.json.format(msgspec.json.encode(manifest))
    descriptor = os.open(draft, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o600)
    with os.fdopen(descriptor, "w+b") as file:
        mode = "w" if name.endswith(".tar") else "w:gz"
        with tarfile.open(fileobj=file, mode=mode, format=tarfile.PAX_FORMAT) as archive:  # type: ignore[call-overload]
            archive.addfile(_header(MANIFEST, len(content), manifest), io.BytesIO(content))
            for listed in manifest.files:
                with (copies / listed.path).open("rb") as source:
                    archive.addfile(_header(listed.path, listed.size_bytes, manifest), source)
        file.flush()
        os.fsync(file.fileno())


def _header(path: str, size_bytes: int, manifest: Manifest) -> tarfile.TarInfo:
    header = tarfile.TarInfo(path)
    header.size, header.mtime, header.mode = size_bytes, manifest.unix_s, 0o600
    return header


def _publish(draft: Path, archive: Path) -> None:
    """Give the archive its name, if no file has it meanwhile."""
    try:
        os.link(draft, archive)
    except FileExistsError:
        raise BackupError(f"{archive}: exists already; a backup is never overwritten") from None
    except OSError:  # a disk without hard links, such as FAT
        draft.rename(archive)
    sync_folder(archive.parent)
