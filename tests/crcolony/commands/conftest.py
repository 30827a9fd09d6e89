"""Running wrong command lines."""

import shlex
from pathlib import Path

import pytest

from tests.support.command_line import Refused, refusal


@pytest.fixture
def refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Refused:
    """Run a command line in an empty folder; return the line with which it is refused."""
    monkeypatch.chdir(tmp_path)
    return lambda words: refusal(capsys, *shlex.split(words))
