"""Which results folder on this machine belongs to robots that are online, by the keys that it holds."""

import contextlib
from collections.abc import Collection, Iterator
from pathlib import Path

from crcolony.protocol.identity import IdentityError, RobotId, load_key
from crcolony.storage.files import KEY_FILE

_MAX_FOLDERS = 50
"""Of the newest results folders so many are searched"""
_MAX_KEYS = 64
"""Of one folder so many keys are read"""


def run_of_robots(robots: Collection[RobotId], runs: Path) -> Path | None:
    """Return the newest folder in `runs` that holds the key of one of these robots; None if there is none.

    Where the robots run on another machine, or their folder is elsewhere, none is found.
    """
    wanted = set(robots)
    for folder in (part for run in _newest(runs) for part in (run, run / "live")):
        if not wanted.isdisjoint(_robots_in(folder)):
            return folder
    return None


def _newest(runs: Path) -> list[Path]:
    with contextlib.suppress(OSError):
        folders = [(path.stat().st_mtime, path) for path in runs.iterdir() if path.is_dir()]
        return [path for _, path in sorted(folders, reverse=True)[:_MAX_FOLDERS]]
    return []


def _robots_in(folder: Path) -> Iterator[RobotId]:
    for path in sorted((folder / "robots").glob(f"*/{KEY_FILE}"))[:_MAX_KEYS]:
        with contextlib.suppress(IdentityError):  # an unreadable key shows nothing
            yield load_key(path).id
