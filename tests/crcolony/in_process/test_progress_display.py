"""The progress of a run is shown live in a terminal, and as plain lines elsewhere."""

import os
import select
import signal
import subprocess
import time
from pathlib import Path

import pytest

from crcolony.in_process.progress_display import ProgressDisplay
from tests.support.command_line import (
    FAST,
    command,
)
from tests.support.small_colony import new_colony


def test_a_terminal_shows_a_live_display(tmp_path: Path) -> None:
    """On a pseudo-terminal generation, matings, batteries, energy and speed are drawn, and Ctrl-C ends the run."""
    leader, follower = os.openpty()
    process = subprocess.Popen(
        command("evolve", *FAST, "--generations", "0", "--out", tmp_path / "run"),
        stdin=follower,
        stdout=follower,
        stderr=follower,
        env={**os.environ, "TERM": "xterm", "COLUMNS": "100", "LINES": "30"},
    )
    os.close(follower)
    seen = b""
    deadline_s = time.monotonic() + 120.0
    asked = False
    while time.monotonic() < deadline_s:
        if not select.select([leader], [], [], 1.0)[0]:
            continue
        try:
            piece = os.read(leader, 65536)
        except OSError:  # the other end is closed
            break
        seen += piece
        if b"starved" in seen and not asked:
            asked = True
            process.send_signal(signal.SIGINT)
    assert process.wait(timeout=60) == 0
    os.close(leader)
    for word in (b"generation", b"matings", b"batteries", b"energy", b"robot-steps/s", b"hash"):
        assert word in seen
    assert b"Traceback" not in seen


def test_plain_lines_are_of_the_first_and_last_generation(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Between them a line is printed every few seconds, and a generation has one line at most."""
    colony, _ = new_colony()
    colony.start()
    display = ProgressDisplay(colony)
    while colony.generation < 3:
        colony.run(100)
        display.print_line()
        display.print_line()
    first, last = capsys.readouterr().out.splitlines()
    assert first.startswith("generation 1: matings ")
    assert last.startswith("generation 3: matings ")
    assert last.endswith(" million robot-steps/s")
