"""A process that a launch starts is a new interpreter with our own modules."""

import subprocess
from pathlib import Path

import pytest

import crcolony
from crcolony.runtime.started_process import python_command, start_interpreter


def test_a_command_of_ours_is_run(tmp_path: Path) -> None:
    """Its output goes into a file."""
    with (tmp_path / "log").open("ab") as log, start_interpreter(["--version"], log) as process:
        assert isinstance(process, subprocess.Popen)
        assert process.wait(60.0) == 0
    assert (tmp_path / "log").read_text() == f"crcolony {crcolony.__version__}\n"


def test_files_of_the_working_folder_are_no_modules(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Unless it is the checkout that runs."""
    monkeypatch.chdir(Path(crcolony.__file__).parents[1])
    assert "-P" not in python_command("crcolony")
    monkeypatch.chdir(tmp_path)
    assert "-P" in python_command("crcolony")
