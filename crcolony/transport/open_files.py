"""How many files and sockets a process may open (`ulimit -n`): raised as far as the system allows, or refused."""

import contextlib
import resource

from crcolony.errors import CrcolonyError

_BASE = 64
"""What any process needs: libraries while they are loaded, its console, and a few links."""
_MAX_RAISED = 65_536


class OpenFilesError(CrcolonyError):
    """This process may open too few files."""


def allow_open_files(for_robots: int = 0) -> None:
    """Raise the limit of this process, and of those it will start, to what the system allows.

    Raises OpenFilesError if that is too little `for_robots`: their pipes, files or links.
    """
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = _MAX_RAISED if hard == resource.RLIM_INFINITY else min(hard, _MAX_RAISED)
    if soft != resource.RLIM_INFINITY and soft < wanted:
        with contextlib.suppress(ValueError, OSError):  # macOS has a lower limit of its own
            resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
            soft = wanted
    needed = _BASE + 4 * for_robots
    if soft != resource.RLIM_INFINITY and soft < needed:
        raise OpenFilesError(
            f"only {soft} files may be open at once, and this needs {needed}:"
            f" ulimit -n {needed}, as root or in the limits of the service (LimitNOFILE={needed})"
        )
