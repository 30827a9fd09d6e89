"""Disk and memory suffice, or it is said which does not."""

import os
import shutil
from pathlib import Path

import pytest
from crcolony_deploy.doctor.resources import check_disk, check_memory

from tests.support.examined_hosts import host_of, lines


@pytest.mark.parametrize(
    ("free_mb", "found"),
    [
        (50, "problem: {}: 50 MB free: memories cannot be written"),
        (500, "warning: {}: 500 MB free"),
        (5000, "ok: {}: 5.0 GB free"),
    ],
)
def test_a_disk_that_fills_is_noticed_in_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, free_mb: int, found: str
) -> None:
    """Folders on one disk are one line."""
    usage = shutil.disk_usage(tmp_path)._replace(free=free_mb * 10**6)
    monkeypatch.setattr(shutil, "disk_usage", lambda path: usage)
    assert lines(check_disk(host_of(tmp_path))) == [found.format(tmp_path)]


@pytest.mark.parametrize(
    ("available_kb", "found"),
    [
        (100_000, "warning: 100 MB of memory are available"),
        (2_000_000, "ok: 2.0 GB of memory are available"),
    ],
)
def test_memory_that_runs_out_is_noticed(tmp_path: Path, available_kb: int, found: str) -> None:
    """As the kernel counts it."""
    os.mkdir(tmp_path / "proc")
    (tmp_path / "proc/meminfo").write_text(f"MemTotal: 1 kB\nMemAvailable:  {available_kb} kB\n")
    assert lines(check_memory(host_of(tmp_path))) == [found]
