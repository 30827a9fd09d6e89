"""A robot lives in the first arena of a name, and in those that stand in its file."""

from pathlib import Path

import pytest

from crcolony.storage.files import FolderError
from crcolony.storage.known_arenas import KnownArenasFile

FIRST, SECOND = bytes(range(16)), bytes(range(1, 17))


def test_the_first_arena_of_a_name_is_remembered(tmp_path: Path) -> None:
    """Across starts; another one of that name is not accepted, one of another name is."""
    path = tmp_path / "known_arenas"
    known = KnownArenasFile(path)
    assert not path.exists()
    assert known.accepts("lab", FIRST)
    for arenas in (known, KnownArenasFile(path)):
        assert arenas.accepts("lab", FIRST)
        assert not arenas.accepts("lab", SECOND)
        assert arenas.accepts("hall", SECOND)


def test_what_a_person_has_written_stays(tmp_path: Path) -> None:
    """Several arenas of one name are a list of those that are allowed; comments are kept."""
    path = tmp_path / "known_arenas"
    text = f"# ours\nlab {FIRST.hex()}  # the old one\n\nlab {SECOND.hex()}"
    path.write_text(text)
    known = KnownArenasFile(path)
    assert known.accepts("lab", FIRST)
    assert known.accepts("lab", SECOND)
    assert not known.accepts("lab", bytes(16))
    assert known.accepts("hall", FIRST)
    assert path.read_text() == f"{text}\nhall {FIRST.hex()}\n"


@pytest.mark.parametrize("line", ["lab", "lab 12", "lab xyz", f"lab {FIRST.hex()} {FIRST.hex()}"])
def test_a_malformed_line_is_named(tmp_path: Path, line: str) -> None:
    """With its file and number."""
    path = tmp_path / "known_arenas"
    path.write_text(f"lab {FIRST.hex()}\n{line}\n")
    with pytest.raises(FolderError, match=f"{path}: line 2: not the name and id of an arena"):
        KnownArenasFile(path)


def test_a_file_that_cannot_be_read_or_written_is_named(tmp_path: Path) -> None:
    """No robot lives in an arena that it would not know again."""
    with pytest.raises(FolderError, match="cannot be read"):
        KnownArenasFile(tmp_path)
    known = KnownArenasFile(tmp_path / "missing" / "known_arenas")
    with pytest.raises(FolderError, match="cannot be written"):
        known.accepts("lab", FIRST)
