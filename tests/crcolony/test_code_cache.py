"""Compiled code is kept in the user's cache, or else in a temporary folder, or else nowhere: never with a traceback."""

import os
import pwd
import shutil
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from crcolony import code_cache
from crcolony.code_cache import find_folder, guard, share_between_installations, usual_root

MADE_BY_A_FILE = "file/is/no/folder"


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the only folder for temporary files; the cache is in a place where nothing can be written."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    (tmp_path / "file").touch()
    monkeypatch.delenv("TMPDIR", raising=False)
    monkeypatch.setattr(code_cache, "_TEMPORARY_FOLDERS", (str(folder),))
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / MADE_BY_A_FILE))
    return folder


def own(folder: Path) -> Path:
    """Return this user's folder for compiled code among temporary files."""
    return folder / f"crcolony-{os.getuid()}"


def test_the_cache_is_where_the_environment_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """NUMBA_CACHE_DIR, XDG_CACHE_HOME or HOME, in this order; nothing is printed."""
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    assert find_folder("name") == tmp_path / "home/.cache/crcolony/name"
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert find_folder("name") == tmp_path / "cache/crcolony/name"
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "numba"))
    assert find_folder("name") == tmp_path / "numba/name"
    assert capsys.readouterr().err == ""


def test_a_user_of_no_list_and_without_home_has_no_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in a container with --user."""
    for name in ("HOME", "NUMBA_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)

    def unknown(_: int) -> None:
        raise KeyError("uid not found")

    monkeypatch.setattr(pwd, "getpwuid", unknown)
    assert usual_root() is None


def test_where_the_cache_cannot_be_written_a_temporary_one_is_used(
    temporary: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """With one line that says why, and where it is; the next process finds it again."""
    folder = find_folder("name")
    assert folder == own(temporary) / "name"
    printed = capsys.readouterr().err
    assert printed.count("\n") == 1
    assert "cannot be written: Not a directory; compiled code is kept in" in printed
    (folder / "code").touch()
    assert find_folder("name") == folder
    assert (folder / "code").exists()


def test_a_full_disk_keeps_nothing_new(
    temporary: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A cache that is filled already is used all the same; else no folder is returned."""

    class Usage(NamedTuple):
        free: int

    filled = own(temporary) / "filled"
    filled.mkdir(parents=True)
    own(temporary).chmod(0o700)
    (filled / "code").touch()
    monkeypatch.setattr(shutil, "disk_usage", lambda _: Usage(1000))
    assert find_folder("filled") == filled
    assert find_folder("empty") is None
    assert "every start compiles" in capsys.readouterr().err.splitlines()[-1]


def test_a_temporary_folder_that_others_could_fill_is_not_used(
    temporary: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Machine code is executed: one that others may write to, or a link to elsewhere, is left alone."""
    own(temporary).mkdir()
    own(temporary).chmod(0o777)
    assert find_folder("name") is None
    own(temporary).rmdir()
    (temporary / "elsewhere").mkdir()
    own(temporary).symlink_to(temporary / "elsewhere")
    assert find_folder("name") is None
    assert not list((temporary / "elsewhere").iterdir())
    assert capsys.readouterr().err.count("\n") == 2


def test_what_a_read_only_cache_holds_is_copied(
    temporary: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """As in a container's image whose user has changed: nothing has to be compiled again."""
    read_only = tmp_path / "image"
    (read_only / "name").mkdir(parents=True)
    (read_only / "name" / "code").write_text("compiled")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(read_only))
    writable = code_cache._why_unwritable

    def why(folder: Path) -> str:  # root may write anywhere: this stands in for a read-only disk
        return "read-only" if folder.is_relative_to(read_only) else writable(folder)

    monkeypatch.setattr(code_cache, "_why_unwritable", why)
    folder = find_folder("name")
    assert folder == own(temporary) / "name"
    assert (folder / "code").read_text() == "compiled"
    assert [path.name for path in own(temporary).iterdir()] == ["name"]


class FakeCache:
    """A damaged cache of numba on a full disk, which notes whether it is locked when it is written."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.flushed = 0
        self.was_locked = False
        self._cache_file = self

    def load_overload(self, _signature: object, _context: object) -> object:
        raise EOFError("Ran out of input")

    def save_overload(self, _signature: object, _code: object) -> None:
        import fcntl

        other = os.open(self._folder, os.O_RDONLY)
        try:
            fcntl.flock(other, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self.was_locked = True
        finally:
            os.close(other)
        raise OSError(28, "No space left on device")

    def _load_index(self) -> None:
        raise EOFError("Ran out of input")

    def flush(self) -> None:
        self.flushed += 1


def test_a_damaged_cache_compiles_again_and_a_full_one_saves_nothing(tmp_path: Path) -> None:
    """numba would raise for both; one process writes at a time."""
    cache = FakeCache(tmp_path)
    function: Any = type("Function", (), {"_cache": cache})
    guard(function, tmp_path)
    assert cache.load_overload(None, None) is None
    cache.save_overload(None, None)
    assert cache.was_locked
    assert cache.flushed == 1


DOUBLE = """
import numba, sys
from pathlib import Path
from crcolony.code_cache import guard

numba.config.CACHE_DIR = sys.argv[1]

def double(x):
    return 2 * x

function = numba.njit(cache=True)(double)
guard(function, Path(sys.argv[1]))
kinds = [int, float, complex]
for kind in kinds[int(sys.argv[2]):] + kinds[:int(sys.argv[2])]:
    assert function(kind(3)) == kind(6), (kind, function(kind(3)))
print(sum(function.stats.cache_hits.values()))
"""


def test_processes_that_compile_at_once_share_one_cache(tmp_path: Path) -> None:
    """Real ones, of numba: afterwards all that they compiled is found, also beside files cut short."""
    import subprocess
    import sys

    from tests.support.command_line import ENVIRONMENT

    script = tmp_path / "double.py"
    script.write_text(DOUBLE)
    (tmp_path / "cache").mkdir()

    def start(first: int) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [sys.executable, str(script), str(tmp_path / "cache"), str(first)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={**ENVIRONMENT, "NUMBA_DISABLE_JIT": "0"},
        )

    def ended(process: subprocess.Popen[str]) -> int:
        output, errors = process.communicate(timeout=200)
        assert process.returncode == 0, errors
        return int(output)

    for process in [start(first) for first in range(3)]:
        ended(process)
    assert ended(start(0)) == 3
    for path in (tmp_path / "cache").rglob("*.nb?"):
        os.truncate(path, path.stat().st_size // 2)
    assert ended(start(0)) == 0
    assert ended(start(0)) == 3


def test_another_installation_of_the_same_sources_compiles_nothing(tmp_path: Path) -> None:
    """Real ones, of numba, whose files are in other places and of other times; other sources find nothing."""
    import numba

    def installed(place: str, folder: Path) -> Any:
        path = tmp_path / place / "sample.py"
        path.parent.mkdir(exist_ok=True)
        path.write_text("def double(x):\n    return 2 * x\n")
        os.utime(path, (len(place), len(place)))
        names: dict[str, Any] = {"__name__": "crcolony.learning.sample"}
        exec(compile(path.read_text(), str(path), "exec"), names)
        function = numba.njit(cache=True)(names["double"])
        folder.mkdir(exist_ok=True)
        share_between_installations(function, folder)
        assert function(3) == 6
        return function.stats

    same, other = tmp_path / "digest", tmp_path / "other-digest"
    assert not installed("first", same).cache_hits
    assert sum(installed("another", same).cache_hits.values()) == 1
    assert not installed("another", other).cache_hits
