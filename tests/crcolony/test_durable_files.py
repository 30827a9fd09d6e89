"""Files are on the disk as a whole or not at all, and secrets are their owner's alone."""

from pathlib import Path
from typing import BinaryIO

import pytest

from crcolony.durable_files import create_secret, replace_file


def test_a_file_is_replaced_as_a_whole_or_not_at_all(tmp_path: Path) -> None:
    """If writing fails in the middle, the former content stays and no draft is left."""
    path = tmp_path / "file"
    replace_file(path, lambda file: file.write(b"former"))

    def fail(file: BinaryIO) -> None:
        file.write(b"half")
        raise OSError(28, "No space left on device")

    with pytest.raises(OSError, match="No space left"):
        replace_file(path, fail)
    assert path.read_bytes() == b"former"
    assert [file.name for file in tmp_path.iterdir()] == ["file"]


def test_a_secret_is_for_its_owner_and_never_overwritten(tmp_path: Path) -> None:
    """Whatever the mask of the user gives to new files."""
    path = tmp_path / "key"
    create_secret(path, b"secret")
    assert path.stat().st_mode & 0o777 == 0o600
    with pytest.raises(FileExistsError):
        create_secret(path, b"another")
    assert path.read_bytes() == b"secret"
