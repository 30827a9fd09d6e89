"""What robots and arenas need is compiled ahead, once, into a folder that is named."""

from pathlib import Path

import pytest

from crcolony.cli import main
from crcolony.runtime.compile_ahead import compile_ahead, kept_code


def test_compiled_code_lies_in_the_folder_that_is_printed(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A robot finds its control step there, and an arena its world."""
    folder = compile_ahead(lambda line: None)
    assert list(folder.glob("step-*.o"))
    assert list(folder.rglob("tick.step_world*.nbi"))
    assert main(["compile", "--where"]) == 0
    assert Path(capsys.readouterr().out.strip()) == folder == kept_code()


def test_a_machine_that_can_keep_nothing_is_told_so(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In one line."""
    monkeypatch.setattr("crcolony.runtime.compile_ahead.cache_folder", lambda: None)
    assert main(["compile"]) == 2
    assert "cannot be kept" in capsys.readouterr().err
