"""Files and folders of runs: atomic replacement, and the names of what a folder holds."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

from crcolony.errors import CrcolonyError


class FolderError(CrcolonyError):
    """A results folder cannot be read or written: the message names the file and the reason."""


def replace_file(path: Path, write: Callable[[BinaryIO], object]) -> None:
    """Write a file whole or not at all."""
    draft = path.with_name(path.name + ".part")
    try:
        with draft.open("wb") as file:
            write(file)
            file.flush()
            os.fsync(file.fileno())
        draft.replace(path)
    finally:
        draft.unlink(missing_ok=True)


ROBOT_FILE, KEY_FILE, ARENA_CHECKPOINT = "robot.sqlite", "key", "arena.npz"
"""What the folders of robots and arenas hold."""


def make_folder(folder: Path) -> None:
    """Make a folder; raises FolderError if that is impossible."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FolderError(f"{folder}: cannot be made: {error.strerror}") from None
