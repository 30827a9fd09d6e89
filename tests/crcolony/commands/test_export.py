"""`crcolony export`: export recorded telemetry."""

import shlex
from pathlib import Path

import pytest

from tests.support.command_line import refusal


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("export missing", "missing"),
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
