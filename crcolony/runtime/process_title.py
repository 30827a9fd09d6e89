"""What `ps` and `top` show of a process that was forked: its own command line, in place of that of what forked it."""

import contextlib
import ctypes
import os
from collections.abc import Sequence
from pathlib import Path

_FIRST_FIELD = 3
_ARGUMENTS_START, _ARGUMENTS_END = 48, 49
"""Fields of /proc/PID/stat (proc(5)), of which the first after the name has number 3."""


def show_command(words: Sequence[str]) -> None:
    """Show these words, which are cut off where this process's own command line ended, and the first two as its name.

    Only Linux has it; elsewhere nothing is done.
    """
    with contextlib.suppress(OSError):
        Path("/proc/self/comm").write_text(" ".join(words[:2]))
        fields = Path("/proc/self/stat").read_text().rpartition(")")[2].split()
        start, end = (
            int(fields[number - _FIRST_FIELD]) for number in (_ARGUMENTS_START, _ARGUMENTS_END)
        )
        room = end - start - 2
        if room > 0:
            # The last byte is not 0: the system shows what comes before the first 0 then, not all (setproctitle(3)).
            text = os.fsencode(" ".join(words))[:room].ljust(room + 1, b"\0")
            ctypes.memmove(start, text + b"\n", room + 2)
