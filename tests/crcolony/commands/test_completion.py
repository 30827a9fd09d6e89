"""`crcolony completion`: shells complete commands, options and settings."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from crcolony.cli import main
from tests.support.command_line import ENVIRONMENT, Refused


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_a_script_for_the_shell_is_printed(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    """It calls the command itself."""
    assert main(["completion", shell]) == 0
    script = capsys.readouterr().out
    assert "crcolony" in script
    bash = shutil.which(shell)
    if bash is not None:  # the shell itself says whether it is a script
        subprocess.run([bash, "-n"], input=script, text=True, check=True)


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("crcolony evol", ["evolve"]),
        ("crcolony evolve --sel", ["--selection"]),
        ("crcolony evolve --selection c", ["central"]),
        ("crcolony evolve --set life.slice", ["life.slices=", "life.slice_steps="]),
    ],
)
def test_bash_completes_a_line(line: str, expected: list[str], tmp_path: Path) -> None:
    """As after Tab, in a real bash with the printed script."""
    command = tmp_path / "crcolony"
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m crcolony "$@"\n')
    command.chmod(0o755)
    script = """
        eval "$(crcolony completion bash)"
        COMP_LINE=$1 COMP_POINT=${#1} COMP_TYPE=9
        _python_argcomplete crcolony
        printf '%s\\n' "${COMPREPLY[@]}"
    """
    done = subprocess.run(
        ["bash", "-c", script, "bash", line],
        capture_output=True,
        text=True,
        timeout=60,
        cwd=tmp_path,
        env={**ENVIRONMENT, "PATH": f"{tmp_path}:{os.environ['PATH']}"},
    )
    assert sorted(word.strip() for word in done.stdout.split()) == sorted(expected), done.stderr


@pytest.mark.parametrize(
    ("words", "line"),
    [("completion csh", "invalid choice: 'csh'"), ("completion", "required: shell")],
)
def test_wrong_options_are_refused_in_one_line(words: str, line: str, refused: Refused) -> None:
    """The line names the option, and the reason."""
    assert line in refused(words)
