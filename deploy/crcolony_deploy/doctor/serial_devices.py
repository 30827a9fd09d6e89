"""Whether the devices of bridges are there, and may be opened by the services' user."""

import grp
import os
import pwd
import stat
from collections.abc import Iterator
from pathlib import Path

from crcolony_deploy.doctor.finding import Finding, ok, problem
from crcolony_deploy.doctor.host_state import USER, HostState

_GROUP = "dialout"
"""A supplementary group of the bridge's unit."""


def check_serial_devices(host: HostState) -> Iterator[Finding]:
    """Look at every device of every bridge that is a file."""
    for bridge in host.of_kind("bridge"):
        for robot in bridge.values("--robot"):
            address = robot.partition("@")[2].partition("?")[0]
            if address.startswith("/"):
                yield _examine(Path(address))


def _examine(path: Path) -> Finding:
    try:
        state = path.stat()
    except OSError as error:
        return problem(
            f"{path}: {error.strerror}", "is the robot plugged in and on? crcolony bridge list"
        )
    if not stat.S_ISCHR(state.st_mode):
        return problem(f"{path}: is no device", "crcolony bridge list shows the devices")
    if not _may_open(state):
        group = _group_name(state.st_gid)
        return problem(
            f"{path}: user {USER} may not open it (group {group}, mode {state.st_mode & 0o777:o})",
            f"give it to the group {_GROUP} by a udev rule, as Debian does for serial devices",
        )
    return ok(f"{path}: user {USER} may open it")


def _may_open(state: os.stat_result) -> bool:
    mode = state.st_mode
    if mode & 0o006 == 0o006:
        return True
    if _group_name(state.st_gid) == _GROUP and mode & 0o060 == 0o060:
        return True
    try:
        return state.st_uid == pwd.getpwnam(USER).pw_uid and mode & 0o600 == 0o600
    except KeyError:
        return False


def _group_name(gid: int) -> str:
    try:
        return grp.getgrgid(gid).gr_name
    except KeyError:
        return str(gid)
