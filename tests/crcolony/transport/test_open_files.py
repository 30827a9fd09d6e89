"""The limit of open files is raised where that is possible; where it is too small a line says what to do."""

import resource
import subprocess
import sys
from pathlib import Path

import pytest

from crcolony.transport import open_files
from crcolony.transport.open_files import OpenFilesError, allow_open_files
from tests.support.command_line import ENVIRONMENT, command

LIMIT_AFTER = """
import resource
from crcolony.transport.open_files import allow_open_files
allow_open_files(10)
print(resource.getrlimit(resource.RLIMIT_NOFILE))
"""


def run_with_limits(soft: int, hard: int, *words: str) -> subprocess.CompletedProcess[str]:
    """Run a command in a shell with these limits."""
    shell = f'ulimit -Sn {soft} && ulimit -Hn {hard} && exec "$@"'
    return subprocess.run(
        ["sh", "-c", shell, "sh", *words],
        capture_output=True,
        text=True,
        timeout=200,
        env=ENVIRONMENT,
    )


def test_the_limit_is_raised_as_far_as_the_system_allows() -> None:
    """In this process, and so in those that it starts."""
    done = run_with_limits(70, 300, sys.executable, "-c", LIMIT_AFTER)
    assert done.stdout == "(300, 300)\n", done.stderr


@pytest.mark.parametrize("words", ["launch -n 30", "host -n 30", "arena --robots 30"])
def test_a_limit_that_is_too_small_is_one_line_that_says_what_to_do(
    words: str, tmp_path: Path
) -> None:
    """Before anything is started or written."""
    out = tmp_path / "run"
    done = run_with_limits(100, 100, *command(*words.split(), "--out", out))
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert line.startswith("crcolony: only 100 files may be open at once, and this needs ")
    assert "ulimit -n " in line
    assert not out.exists()


def test_a_limit_that_cannot_be_raised_is_used_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """As on systems that have another limit, below the one they name."""

    def refuse(*_: object) -> None:
        raise ValueError("not allowed to raise maximum limit")

    monkeypatch.setattr(resource, "setrlimit", refuse)
    monkeypatch.setattr(resource, "getrlimit", lambda _: (256, resource.RLIM_INFINITY))
    allow_open_files(10)
    with pytest.raises(OpenFilesError, match="only 256 files"):
        allow_open_files(1000)
    monkeypatch.setattr(resource, "getrlimit", lambda _: (resource.RLIM_INFINITY,) * 2)
    allow_open_files(10**9)
    assert open_files._BASE < 256
