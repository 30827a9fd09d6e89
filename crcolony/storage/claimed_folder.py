"""A folder belongs to what made it: a command makes a new one, or goes on in one that it made before, and locks it.

A folder of anything else is refused with the command that would do what was meant, and stays as it is.
"""

import contextlib
import os
import shlex
import shutil
from pathlib import Path

from crcolony.config import CONFIG_FILE
from crcolony.durable_files import replace_file
from crcolony.storage.files import FolderError, lock_folder
from crcolony.storage.folder_record import (
    FolderRecord,
    Maker,
    config_digest,
    maker_of,
    write_record,
)
from crcolony.storage.founders_file import Beginning, write_founders

_RUNS = Path("runs")
"""Where folders are made that a user has not named."""
_BEGINNERS: frozenset[Maker] = frozenset(("evolve", "launch", "host", "robot"))
"""What can begin with the robots of an earlier run."""
_SOURCES = _BEGINNERS
"""What makes folders whose robots others can begin with."""
_BESIDE: dict[Maker, frozenset[Maker]] = {
    "dashboard": frozenset(("launch", "host", "demo", "arena"))
}
"""What may write its own files into the folder of another command."""


class ClaimedFolder:
    """A folder of this process alone, until it is closed (as at the end of its context) or the process ends."""

    def __init__(
        self, path: Path, maker: Maker, lock: int, is_new: bool, made: tuple[Path, ...]
    ) -> None:
        self.path = path
        self.is_new = is_new
        """Whether nothing was in it"""
        self._maker: Maker = maker
        self._made = made
        """The folders that were made for it, the innermost, itself, first; none if it was there before"""
        self._lock: int | None = lock

    def begin(self, config: str = "", beginning: Beginning | None = None) -> None:
        """Write into a new folder what makes it, its config (TOML) and what its robots begin with.

        Raises FolderError. The record is first: whatever is missing after a crash, it shows.
        """
        digest = config_digest(config) if config else ""
        origin = beginning.origin if beginning is not None else None
        try:
            write_record(self.path, FolderRecord(self._maker, digest, origin))
        except OSError as error:
            raise FolderError(f"{self.path}: cannot be written: {error.strerror}") from None
        if config:
            self.write_config(config)
        if beginning is not None:
            write_founders(self.path, beginning.founders)

    def write_config(self, config: str) -> None:
        """Write the config (TOML), which may differ from the first one in what its digest leaves out."""
        content = config.encode()
        try:
            replace_file(self.path / CONFIG_FILE, lambda file: file.write(content))
        except OSError as error:
            raise FolderError(f"{self.path}: cannot be written: {error.strerror}") from None

    def discard(self) -> None:
        """Delete what was made in a new folder, and the folders that were made for it; close it."""
        self.close()
        shutil.rmtree(self.path)
        if not self._made:
            self.path.mkdir()
        for parent in self._made[1:]:
            with contextlib.suppress(OSError):  # another process has made something in it meanwhile
                parent.rmdir()

    def __enter__(self) -> "ClaimedFolder":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Let other processes have the folder."""
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None


def claim_folder(folder: Path | None, maker: Maker) -> ClaimedFolder:
    """Make a folder, or take one that is empty or was made by the same command, and lock it.

    None makes the next free runs/1, runs/2, …: two processes at a time get two folders. Raises FolderError.
    """
    if folder is None:
        made = _make_numbered_folder()
        folder = made[0]
    else:
        made = _make(folder)
    if not made:
        check_folder(
            folder, maker
        )  # before the lock: why it is refused matters more than who uses it
    lock = lock_folder(folder)
    try:
        is_new = not any(folder.iterdir())
        if not made and not is_new:
            check_folder(folder, maker)  # another process may have begun in it meanwhile
        return ClaimedFolder(folder, maker, lock, is_new, made)
    except BaseException:
        os.close(lock)
        raise


def begin_demo_folder(folder: Path | None) -> ClaimedFolder:
    """Make the folder of a demo, which holds two runs; raises FolderError for one that is not empty."""
    claimed = claim_folder(folder, "demo")
    if not claimed.is_new:
        claimed.close()
        live, evolved = (shlex.quote(str(claimed.path / name)) for name in ("live", "evolved"))
        raise FolderError(
            f"{claimed.path}: made by crcolony demo; to go on with its robots: crcolony launch"
            f" --out {live}; with its evolution: crcolony evolve --resume --out {evolved}"
        )
    claimed.begin()
    return claimed


def check_folder(folder: Path, maker: Maker) -> None:
    """Raise FolderError, with what the user can do instead, if a folder was made by something else than `maker`.

    What needs a folder of its own is refused one with unknown files too.
    """
    if not folder.exists():
        return
    owner = maker_of(folder)
    if owner is None and (maker in ("robot", "arena", "dashboard") or not _has_files(folder)):
        return
    if owner != maker and owner not in _BESIDE.get(maker, ()):
        raise FolderError(f"{folder}: {_refusal(folder, owner, maker)}")


def check_output_folder(folder: Path) -> None:
    """Raise FolderError if figures or tables are to be written between the files of a run, not into a folder beside."""
    owner = maker_of(folder)
    if owner is not None:
        raise FolderError(
            f"{folder}: made by crcolony {owner}; choose another --out, as in --out"
            f" {shlex.quote(str(folder / 'figures'))}"
        )


def existing_run_advice(folder: Path) -> str:
    """Return how to go on with an in-process run, or from it, for one who asked for a new run in its folder."""
    name = shlex.quote(str(folder))
    return (
        f"made by crcolony evolve; to go on with it: crcolony evolve --resume --out {name};"
        f" to begin a new run with its robots: crcolony evolve --from {name}"
    )


def _refusal(folder: Path, owner: Maker | None, maker: Maker) -> str:
    if owner is None:
        return "not empty; choose another --out"
    made_by = f"made by crcolony {owner}"
    name = shlex.quote(str(folder))
    if maker == "dashboard" and owner in _SOURCES:
        return f"{made_by}; to see it: crcolony replay {name}"
    if owner == "evolve --seeds" and maker in _BEGINNERS:
        runs = sorted(folder.glob("*/seed-*"))
        name = shlex.quote(str(runs[0])) if runs else f"{name}/…/seed-1"
        return f"{made_by}; to begin with the robots of one of its runs: {_begin(maker, name)}"
    if owner == "demo" and maker in _BEGINNERS:
        name = shlex.quote(str(folder / "evolved"))
        return f"{made_by}; to begin with the robots that evolved in it: {_begin(maker, name)}"
    if owner in _SOURCES and maker in _BEGINNERS:
        return f"{made_by}; to begin with its robots: {_begin(maker, name)}"
    return f"{made_by}; choose another --out"


def _begin(maker: Maker, name: str) -> str:
    return f"crcolony {maker} --from {name}" + (" --out NEW" if maker == "robot" else "")


def _has_files(folder: Path) -> bool:
    try:
        return any(folder.iterdir())
    except NotADirectoryError:
        raise FolderError(f"{folder}: a file, not a folder; choose another --out") from None
    except OSError as error:
        raise FolderError(f"{folder}: cannot be read: {error.strerror}") from None


def make_numbered_folder() -> Path:
    """Make and return the next free of runs/1, runs/2, …: no other process gets the same. Raises FolderError."""
    return _make_numbered_folder()[0]


def _make_numbered_folder() -> tuple[Path, ...]:
    number = 1
    while not (made := _make(_RUNS / str(number))):
        number += 1
    return made


def _make(folder: Path) -> tuple[Path, ...]:
    """Make a folder and its parents; return what was made, the innermost first, or () if it was there.

    Raises FolderError.
    """
    missing = [parent for parent in folder.parents if not parent.exists()]
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        folder.mkdir()
    except FileExistsError:
        return ()
    except OSError as error:
        raise FolderError(f"{folder}: cannot be made: {error.strerror}") from None
    return (folder, *missing)
