"""What made a folder: a small file in it says so, and the content of a folder of an earlier version shows it."""

import hashlib
import tomllib
from pathlib import Path
from typing import Literal

import msgspec
import tomli_w

from crcolony.config import CONFIG_FILE
from crcolony.durable_files import replace_file
from crcolony.storage.files import (
    ARENA_CHECKPOINT,
    FORMER_ROBOT_FILE,
    KEY_FILE,
    ROBOT_FILE,
    FolderError,
)

RECORD_FILE = "made_by.toml"
"""The name of the file in a folder that says what made it."""

Maker = Literal[
    "evolve",
    "evolve --seeds",
    "experiment",
    "launch",
    "host",
    "demo",
    "robot",
    "arena",
    "dashboard",
]
"""A command that writes into a folder of its own, as a user types it."""

_SIGNS: tuple[tuple[Maker, tuple[str, ...]], ...] = (
    ("experiment", ("experiment.json",)),
    ("evolve", ("checkpoint.npz",)),
    ("evolve", (CONFIG_FILE, "history.sqlite-wal")),
    ("evolve --seeds", ("outcomes.csv",)),
    ("evolve --seeds", ("*/seed-*/config.toml",)),
    ("launch", (CONFIG_FILE, "robots", "logs")),
    ("host", (CONFIG_FILE, "robots")),
    ("robot", (ROBOT_FILE,)),
    ("robot", (FORMER_ROBOT_FILE,)),
    ("robot", (KEY_FILE,)),
    ("arena", (ARENA_CHECKPOINT,)),
    ("dashboard", ("telemetry.sqlite",)),
    ("dashboard", ("dashboard.rrd",)),
)
"""Files that show what made a folder without a record: the first row of which all are there."""


class Origin(msgspec.Struct, frozen=True):
    """Where the robots of a folder come from: an earlier run."""

    run: str
    """Its folder, as an absolute path"""
    generation: int
    """The newest that was taken"""
    population: str
    """The digest of all genotypes that were taken"""


class FolderRecord(msgspec.Struct, frozen=True, omit_defaults=True):
    """What made a folder, and from what."""

    made_by: Maker
    config: str = ""
    """The digest of its config file; empty: it has none"""
    origin: Origin | None = None


def write_record(folder: Path, record: FolderRecord) -> None:
    """Write the record of a folder; raises OSError."""
    content = tomli_w.dumps(msgspec.to_builtins(record)).encode()
    replace_file(folder / RECORD_FILE, lambda file: file.write(content))


def read_record(folder: Path) -> FolderRecord | None:
    """Return the record of a folder, None if it has none; raises FolderError for one that cannot be read."""
    path = folder / RECORD_FILE
    try:
        return msgspec.convert(tomllib.loads(path.read_text("utf-8")), FolderRecord)
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        raise FolderError(f"{path}: cannot be read: {error.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, msgspec.ValidationError) as error:
        raise FolderError(f"{path}: corrupt: {error}") from None


def maker_of(folder: Path) -> Maker | None:
    """Return what made a folder, None if nothing of ours is in it; raises FolderError if its record is damaged."""
    record = read_record(folder)
    if record is not None:
        return record.made_by
    for maker, signs in _SIGNS:
        if all(any(folder.glob(sign)) for sign in signs):
            return maker
    return None


def config_digest(config: str) -> str:
    """Return the digest of a config (TOML), as hex digits; raises tomllib.TOMLDecodeError.

    The number of generations does not count: a finished run can go on with more.
    """
    settings = tomllib.loads(config)
    settings.pop("generations", None)
    content = msgspec.msgpack.encode(settings, order="deterministic")
    return hashlib.blake2b(content, digest_size=16).hexdigest()


def check_config_digest(folder: Path) -> None:
    """Raise FolderError if the config of a folder is missing, or was changed since the folder was made."""
    record, path = read_record(folder), folder / CONFIG_FILE
    try:
        digest = config_digest(path.read_text("utf-8"))
    except FileNotFoundError:
        raise FolderError(f"{path}: missing") from None
    except OSError as error:
        raise FolderError(f"{path}: cannot be read: {error.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise FolderError(f"{path}: corrupt: {error}") from None
    if record is not None and record.config not in ("", digest):
        raise FolderError(
            f"{path}: changed since the run was started, which cannot go on with other settings;"
            " undo the change, or start another run with --config"
        )
