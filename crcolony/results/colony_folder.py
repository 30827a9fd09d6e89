"""The folder of a colony of processes (`launch`, `host`): its config, what its robots begin with, and their folders.

made_by.toml       what made the folder, and from which earlier run
config.toml        the effective config
founders.npz       what its robots began with, if that was an earlier run
robots/N           the folder of each robot: its key, its file, and its founders
arena.npz          the checkpoint of a host's arena; that of a launch has a folder of its own, arena/
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal

import msgspec

from crcolony.config import CONFIG_FILE, Config, load, to_toml
from crcolony.durable_files import replace_file
from crcolony.evolution.founders import Founders
from crcolony.storage.claimed_folder import ClaimedFolder, claim_folder
from crcolony.storage.files import (
    ARENA_CHECKPOINT,
    KEY_FILE,
    ROBOT_FILE,
    FolderError,
    existing_robot_file,
    lock_of,
    make_folder,
)
from crcolony.storage.folder_record import (
    FolderRecord,
    check_config_digest,
    read_record,
    write_record,
)
from crcolony.storage.founders_file import (
    Beginning,
    read_founders,
    write_founders,
)


class ColonyFolder:
    """A folder of this process alone inside its context."""

    def __init__(self, claimed: ClaimedFolder, beginning: Beginning | None) -> None:
        self.path = claimed.path
        self.beginning = beginning
        self._claimed = claimed

    @property
    def founders(self) -> Founders | None:
        """What the robots begin with; None: random genotypes."""
        return self.beginning.founders if self.beginning is not None else None

    @property
    def population(self) -> str:
        """The digest of the genotypes that the colony begins with; empty for random ones."""
        return self.beginning.origin.population if self.beginning is not None else ""

    def prepare_robot(self, number: int) -> Path:
        """Make the folder of a robot, with what it begins with, unless it is there; raises FolderError."""
        folder = self.path / "robots" / str(number)
        make_folder(folder)
        is_born = existing_robot_file(folder / ROBOT_FILE).exists()
        if self.beginning is not None and not is_born:
            begin_robot_folder(folder, self.beginning.share_of(number))
        return folder

    def prepare_arena(self) -> Path:
        """Make the folder of a launch's arena, with the checkpoint that earlier versions kept beside it."""
        folder = self.path / "arena"
        make_folder(folder)
        former, checkpoint = self.path / ARENA_CHECKPOINT, folder / ARENA_CHECKPOINT
        if former.exists() and not checkpoint.exists():
            former.rename(checkpoint)
        return folder

    def __enter__(self) -> "ColonyFolder":
        return self

    def __exit__(self, *_: object) -> None:
        """Let other processes have the folder."""
        self._claimed.close()


def open_colony_folder(
    folder: Path | None,
    maker: Literal["launch", "host"],
    config: Config,
    beginning: Beginning | None,
) -> ColonyFolder:
    """Make the folder of a colony (None: the next free runs/N), or open it to go on there.

    Raises FolderError for the folder of something else, of other settings, or one of whose files are missing.
    """
    claimed = claim_folder(folder, maker)
    try:
        if claimed.is_new:
            claimed.begin(to_toml(config), beginning)
        else:
            beginning = _check(claimed.path, config)
    except BaseException:  # Ctrl-C too
        if claimed.is_new:
            claimed.discard()
        claimed.close()
        raise
    return ColonyFolder(claimed, beginning)


def begin_robot_folder(folder: Path, beginning: Beginning, config: Config | None = None) -> None:
    """Write what a robot begins with into its folder, where that comes from, and its config; raises FolderError."""
    write_founders(folder, beginning.founders)
    try:
        if config is not None:
            content = to_toml(config).encode()
            replace_file(folder / CONFIG_FILE, lambda file: file.write(content))
        write_record(folder, FolderRecord("robot", origin=beginning.origin))
    except OSError as error:
        raise FolderError(f"{folder}: cannot be written: {error.strerror}") from None


def check_robot_folder(folder: Path) -> None:
    """Raise FolderError if one of the files of a robot that has lived before is missing."""
    path, key = folder / ROBOT_FILE, folder / KEY_FILE
    is_there = existing_robot_file(path).exists()
    if not is_there and lock_of(path).exists():
        raise FolderError(
            f"{path}: missing; put it back, or delete {folder} to begin with another robot"
        )
    if is_there and not key.exists():
        raise FolderError(f"{key}: missing; without it the robot cannot prove who it is")


def _check(folder: Path, config: Config) -> Beginning | None:
    """Check that a colony can go on in its folder, and return what it began with."""
    check_config_digest(folder)
    differing = list(_differences(load(folder / CONFIG_FILE), config))
    if differing:
        raise FolderError(f"{folder}: holds a colony of other settings: {differing[0]}")
    for own in (folder / "robots").glob("*"):
        check_robot_folder(own)
    record = read_record(folder)
    if record is None or record.origin is None:
        return None
    return Beginning(read_founders(folder), record.origin)


def _differences(there: Config, here: Config) -> Iterator[str]:
    """Yield every setting that differs, with both values."""
    before, now = _flat(msgspec.to_builtins(there)), _flat(msgspec.to_builtins(here))
    for name in before:
        if before[name] != now[name]:
            yield f"{name} is {before[name]} there, {now[name]} here"


def _flat(tree: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Return the settings of a tree by their whole names."""
    settings: dict[str, Any] = {}
    for name, value in tree.items():
        if isinstance(value, dict):
            settings |= _flat(value, f"{prefix}{name}.")
        else:
            settings[f"{prefix}{name}"] = value
    return settings
