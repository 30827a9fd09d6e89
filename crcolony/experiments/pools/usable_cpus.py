"""How many CPUs this process may use: its affinity, and the limits of its control groups, as of a container."""

import math
import os
from collections.abc import Callable
from pathlib import Path, PurePosixPath

Read = Callable[[str], str]
"""Returns the content of a file; raises OSError."""


def usable_cpus() -> int:
    """Return the number of CPUs that this process may use, at least 1."""
    has_affinity = hasattr(os, "sched_getaffinity")
    present = len(os.sched_getaffinity(0)) if has_affinity else os.cpu_count() or 1
    return limited_cpus(present, lambda path: Path(path).read_text("utf-8"))


def limited_cpus(present: int, read: Read) -> int:
    """Return how many of the present CPUs the control groups grant, rounded up, at least 1.

    A group has a quota of CPU time for each period, in v2 as `cpu.max`, in v1 as `cpu.cfs_quota_us` and
    `cpu.cfs_period_us`; it is limited by all groups above it, too.
    """
    shares = [share for group in _groups(read) if (share := _share(group, read)) is not None]
    return max(1, min(present, math.ceil(min(shares, default=present))))


def _groups(read: Read) -> list[str]:
    """Return the folders of the control groups of this process that may limit its CPU time, and of those above."""
    try:
        lines = read("/proc/self/cgroup").splitlines()
    except OSError:  # not Linux
        return []
    groups = []
    for line in lines:
        _, controllers, path = line.split(":", 2)
        root = "/sys/fs/cgroup"
        if controllers:
            if "cpu" not in controllers.split(","):
                continue
            root = f"/sys/fs/cgroup/{controllers}"
        own = PurePosixPath(path)
        groups += [f"{root}{'' if str(one) == '/' else one}" for one in (own, *own.parents)]
    return groups


def _share(group: str, read: Read) -> float | None:
    """Return the CPUs that a group grants; None: no limit, or no such folder in this container."""
    for names in (("cpu.max",), ("cpu.cfs_quota_us", "cpu.cfs_period_us")):
        try:
            quota, period = " ".join(read(f"{group}/{name}") for name in names).split()
            if int(quota) > 0:
                return int(quota) / int(period)
        except (OSError, ValueError):  # "max" is no number
            continue
    return None
