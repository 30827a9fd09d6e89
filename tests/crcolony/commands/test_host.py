"""`crcolony host`: run an arena and many robots in one process."""

import shlex
from pathlib import Path

import pytest

from tests.support.command_line import refusal


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("host -n 3 --robots 2", "-n 3: the arena has 2 slots"),
        ("host -n 0", "-n 0: must be at least 1"),
    ],
)
def test_wrong_options_are_refused_in_one_line(
    words: str,
    line: str,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The line names the option or file, and the reason."""
    monkeypatch.chdir(tmp_path)
    assert line in refusal(capsys, *shlex.split(words))
