"""Recordings leave room on the disk for others."""

import errno
import shutil
from pathlib import Path

import pytest

from crcolony.recordings.disk_space import check_room


def test_a_disk_that_is_nearly_full_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the error of a full disk; a disk with room is not."""
    check_room(tmp_path)
    usage = shutil.disk_usage(tmp_path)
    monkeypatch.setattr(shutil, "disk_usage", lambda path: usage._replace(free=2**20))
    with pytest.raises(OSError, match="No space left on device") as refused:
        check_room(tmp_path)
    assert refused.value.errno == errno.ENOSPC


def test_a_missing_folder_is_an_error_of_the_disk(tmp_path: Path) -> None:
    """As the disk reports it."""
    with pytest.raises(FileNotFoundError):
        check_room(tmp_path / "nowhere")
