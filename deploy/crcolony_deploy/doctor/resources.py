"""Whether disk and memory of this host suffice."""

import shutil
from collections.abc import Iterator
from pathlib import Path

from crcolony_deploy.doctor.finding import Finding, ok, problem, warning
from crcolony_deploy.doctor.host_state import HostState

_LOW_DISK_MB = 1000
_NO_DISK_MB = 100
_LOW_MEMORY_MB = 200


def check_disk(host: HostState) -> Iterator[Finding]:
    """Look at the disk of robots' memories, and of compiled code if that is another one."""
    seen = set()
    for folder in (host.state_folder, host.cache_folder, host.current):
        there = next(path for path in (folder, *folder.parents) if path.exists())
        device = there.stat().st_dev
        if device in seen:
            continue
        seen.add(device)
        free_mb = shutil.disk_usage(there).free / 1e6
        remedy = f"du -xh {there} | sort -h; old versions in /opt/crcolony/versions may be deleted"
        if free_mb < _NO_DISK_MB:
            yield problem(f"{there}: {free_mb:.0f} MB free: memories cannot be written", remedy)
        elif free_mb < _LOW_DISK_MB:
            yield warning(f"{there}: {free_mb:.0f} MB free", remedy)
        else:
            yield ok(f"{there}: {free_mb / 1000.0:.1f} GB free")


def check_memory(host: HostState) -> Iterator[Finding]:
    """Read how much memory new work could get."""
    try:
        text = Path(host.proc / "meminfo").read_text()
    except OSError:
        return
    values = dict(line.split(":", 1) for line in text.splitlines() if ":" in line)
    free_mb = int(values["MemAvailable"].split()[0]) / 1000.0
    if free_mb < _LOW_MEMORY_MB:
        yield warning(
            f"{free_mb:.0f} MB of memory are available",
            "systemd-cgtop -m shows who has it; compiling takes 400 MB once",
        )
    else:
        yield ok(f"{free_mb / 1000.0:.1f} GB of memory are available")
