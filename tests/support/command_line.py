"""Runs the command `crcolony`: as a process of its own, or in this one where it must refuse."""

import argparse
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from crcolony.cli import main, make_parser
from tests.support.paths import PYTHONPATH
from tests.support.small_colony import SMALL

FAST = [
    *("--no-plots", "--generations", "3"),
    *(word for setting in SMALL for word in ("--set", setting)),
]
"""Options of a run of a moment."""
ENVIRONMENT = {**os.environ, "PYTHONPATH": PYTHONPATH, "CRCOLONY_OPEN_NETWORK": "yes"}

Refused = Callable[[str], str]
"""Runs a wrong command line; returns the line with which it is refused."""


def parsers_of_commands() -> dict[str, argparse.ArgumentParser]:
    """Return the parser of every command by its name; actions of a command, as `authority create`, are commands."""
    return dict(_parsers_in(make_parser(), ""))


def _parsers_in(
    parser: argparse.ArgumentParser, before: str
) -> Iterator[tuple[str, argparse.ArgumentParser]]:
    for action in parser._actions:
        if not isinstance(action, argparse._SubParsersAction):
            continue
        for name, one in action.choices.items():
            inner = list(_parsers_in(one, f"{before}{name} "))
            yield from inner or [(f"{before}{name}", one)]


def command(*words: str | Path) -> list[str]:
    """Return the arguments of a process that runs a command."""
    return [sys.executable, "-m", "crcolony", *map(str, words)]


def run_command(*words: str | Path, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Run a command to its end."""
    return subprocess.run(
        command(*words), capture_output=True, text=True, timeout=200, cwd=cwd, env=ENVIRONMENT
    )


def start_command(*words: str | Path) -> subprocess.Popen[str]:
    """Start a command whose output can be read while it runs."""
    return subprocess.Popen(
        command(*words),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=ENVIRONMENT,
    )


def wait_for_line(process: subprocess.Popen[str], text: str) -> None:
    """Read the output of a process until a line contains a text."""
    assert process.stdout is not None
    for line in process.stdout:
        if text in line:
            return
    raise AssertionError(f"the process ended without printing {text}: {process.communicate()[1]}")


def hash_of(output: str) -> str:
    """Return the history hash, which the last line of an output holds."""
    return output.strip().splitlines()[-1].removeprefix("history hash: ")


def refusal(capsys: pytest.CaptureFixture[str], *words: str | Path) -> str:
    """Run a command that must refuse with one line and exit code 2; return the line."""
    try:
        code = main([str(word) for word in words])
    except SystemExit as exit_:  # argparse's own way
        code = int(exit_.code or 0)
    printed = capsys.readouterr()
    assert code == 2, printed
    assert printed.err.count("\n") == 1, printed.err
    assert "Traceback" not in printed.err
    return printed.err.strip()
