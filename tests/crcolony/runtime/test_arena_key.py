"""An arena keeps its key: in its folder, or in one of the user's."""

from pathlib import Path

import pytest

from crcolony.protocol.identity import IdentityError, arena_id
from crcolony.runtime.arena_key import arena_identity, format_arena_id
from crcolony.storage.known_arenas import KnownArenasFile


def test_an_arena_is_known_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By its folder, and without one by its name among the arenas of a user."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    (tmp_path / "arena").mkdir()
    ids = [arena_identity("lab", tmp_path / "arena").id for _ in range(2)]
    ids += [arena_identity(name, None).id for name in ("lab", "lab", "hall")]
    assert ids[0] == ids[1]
    assert ids[2] == ids[3]
    assert len(set(ids)) == 3


def test_where_nothing_can_be_kept_a_person_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The arena runs all the same, with a key of its own."""
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "file"))
    assert arena_identity("lab", None).id != arena_identity("lab", None).id
    assert "--out keeps the key" in capsys.readouterr().out


def test_the_line_that_is_printed_can_be_written_down(tmp_path: Path) -> None:
    """It is what a robot's known_arenas has of this arena."""
    identity = arena_identity("lab", tmp_path)
    line = format_arena_id("lab", identity).removeprefix("known to robots as: ")
    (tmp_path / "known_arenas").write_text(line)
    known = KnownArenasFile(tmp_path / "known_arenas")
    assert known.accepts("lab", arena_id(identity.public_key))
    assert not known.accepts("lab", bytes(16))


def test_a_damaged_key_is_not_replaced(tmp_path: Path) -> None:
    """Robots would not trust another one."""
    (tmp_path / "arena_key").write_text("noise\n")
    (tmp_path / "arena_key").chmod(0o600)
    with pytest.raises(IdentityError, match="not a key"):
        arena_identity("lab", tmp_path)
