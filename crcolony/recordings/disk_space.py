"""Room on the disk: what a dashboard records ends before it is full, for the sake of robots' memories."""

import errno
import os
import shutil
from pathlib import Path

_ROOM_BYTES = 32 * 2**20
"""That are left for others"""


def check_room(folder: Path) -> None:
    """Raise OSError (ENOSPC) if so little room is left that nothing more is to be recorded, or what the disk says."""
    if shutil.disk_usage(folder).free < _ROOM_BYTES:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
