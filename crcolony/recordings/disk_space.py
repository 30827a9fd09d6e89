"""Recordings stop before the disk is full: robots on the same disk need the room for their state."""

import errno
import os
import shutil
from pathlib import Path

_MIN_FREE_BYTES = 32 * 2**20
"""Left to robots."""


def check_room(folder: Path) -> None:
    """Raise OSError (ENOSPC) if the disk of a folder is nearly full, or the error of the disk itself."""
    if shutil.disk_usage(folder).free < _MIN_FREE_BYTES:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
