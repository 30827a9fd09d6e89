"""What is in a backup: the list that is its first file, with a digest of every other."""

import hashlib
from pathlib import Path, PurePosixPath
from typing import Annotated, BinaryIO

import msgspec
from msgspec import Meta

from crcolony.config import CONFIG_FILE
from crcolony.errors import CrcolonyError
from crcolony.storage.files import (
    ARENA_CHECKPOINT,
    ARENA_KEY_FILE,
    FORMER_ROBOT_FILE,
    KEY_FILE,
    KNOWN_ARENAS_FILE,
    ROBOT_FILE,
)
from crcolony.storage.folder_record import RECORD_FILE
from crcolony.storage.founders_file import FOUNDERS_FILE

MANIFEST = "backup.json"
"""The name of the list in the archive."""
FORMAT = 1
ROBOT_FILES = (ROBOT_FILE, FORMER_ROBOT_FILE)
PLAIN_FILES = (CONFIG_FILE, RECORD_FILE, FOUNDERS_FILE, ARENA_CHECKPOINT, KNOWN_ARENAS_FILE)
"""Files that are replaced as a whole, and so can be copied at any moment."""
SECRET_FILES = (KEY_FILE, ARENA_KEY_FILE)
NAMES = frozenset((*ROBOT_FILES, *PLAIN_FILES, *SECRET_FILES))
"""All that a backup holds: no logs, no recordings, no figures, and nothing of other programs."""
MAX_FILES = 20_000
MAX_MANIFEST_BYTES = 16 * 2**20


class BackupError(CrcolonyError):
    """A backup cannot be made or restored: the message names the file and the reason."""


class BackedUpFile(msgspec.Struct, frozen=True):
    """One file of a backup."""

    path: Annotated[str, Meta(max_length=1000)]
    """Within the folder, with slashes"""
    size_bytes: Annotated[int, Meta(ge=0)]
    digest: Annotated[str, Meta(pattern="^[0-9a-f]{64}$")]
    """BLAKE2b, 32 bytes, as hex"""


class BackedUpRobot(msgspec.Struct, frozen=True):
    """One robot of a backup, as it was when it was copied."""

    folder: str
    """Within the backup; `.` if that is the robot's folder"""
    id: Annotated[str, Meta(pattern="^[0-9a-f]{32}$")]
    incarnation: int
    encounters: int
    tick: int
    has_key: bool


class Manifest(msgspec.Struct, frozen=True):
    """The list of a backup."""

    format: int
    unix_s: int
    """When it was made, before the first file was copied"""
    files: Annotated[list[BackedUpFile], Meta(max_length=MAX_FILES)]
    robots: list[BackedUpRobot]


def decode_manifest(data: bytes, archive: Path) -> Manifest:
    """Return a checked list: no path leads out of the folder, none is there twice; raises BackupError."""
    try:
        manifest = msgspec.json.decode(data, type=Manifest)
    except msgspec.DecodeError as error:
        raise BackupError(f"{archive}: damaged: {MANIFEST}: {error}") from None
    if manifest.format != FORMAT:
        raise BackupError(f"{archive}: of format {manifest.format}, not {FORMAT}: update crcolony")
    for file in manifest.files:
        if not is_safe(file.path):
            raise BackupError(f"{archive}: refused: {file.path!r} is no file of a robot's folder")
    if len({file.path for file in manifest.files}) < len(manifest.files):
        raise BackupError(f"{archive}: damaged: a file is listed twice")
    return manifest


def is_safe(path: str) -> bool:
    """Return whether a path of an archive is one of our files, inside the folder, written in the one usual way."""
    parts = PurePosixPath(path).parts
    is_usual = str(PurePosixPath(path)) == path and path.isprintable() and "\\" not in path
    return is_usual and not path.startswith("/") and ".." not in parts and parts[-1] in NAMES


def digest_of_file(file: BinaryIO) -> str:
    """Return the digest of the rest of an open file."""
    digest = hashlib.blake2b(digest_size=32)
    while chunk := file.read(2**20):
        digest.update(chunk)
    return digest.hexdigest()
