"""The progress of a run is shown live in a terminal, and as plain lines elsewhere."""

import contextlib
import os
import select
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from rich.console import Console

from crcolony.compile_progress import Report
from crcolony.in_process import progress_display
from crcolony.in_process.progress_display import ProgressDisplay, format_end, shown_compiling
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


@pytest.mark.parametrize("is_terminal", [True, False])
def test_a_run_that_has_to_compile_says_so(
    is_terminal: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In a terminal with its progress, elsewhere in one line; one that has not says nothing."""
    console = Console(force_terminal=is_terminal, width=80, highlight=False)
    for reports in ((), ((0, 4), (2, 4), (4, 4))):

        @contextlib.contextmanager
        def compiling(
            report: Report, *_: object, reports: tuple[tuple[int, int], ...] = reports
        ) -> Iterator[None]:
            for progress in reports:
                report(*progress)
            yield

        monkeypatch.setattr(progress_display, "compile_progress", compiling)
        with shown_compiling(console):
            pass
        printed = capsys.readouterr().out
        assert ("compiling, which is done once" in printed) == bool(reports)
        assert ("50%" in printed) == (is_terminal and bool(reports))
        assert is_terminal or printed.count("\n") == bool(reports)


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
    assert first.endswith(" s left")


@pytest.mark.parametrize(
    ("rest_s", "text"),
    [
        (12.4, "12 s left"),
        (61.0, "1 min 1 s left"),
        (2.0 * 3600.0, "2 h 0 min left, ends 03:00"),
        (26.0 * 3600.0, "26 h 0 min left, ends 02 Jan 03:00"),
    ],
)
def test_the_end_of_a_run_is_estimated(
    rest_s: float, text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As time left, and for hours as a time of day."""
    monkeypatch.setenv("TZ", "UTC")
    time.tzset()
    assert format_end(rest_s, 3600.0) == text


def test_a_run_without_end_has_no_estimate() -> None:
    """Nor has one that has not begun; one with an end has it beside its speed."""
    for settings, has_estimate in (((), True), (("generations=0",), False)):
        colony, _ = new_colony(*settings)
        colony.start()
        display = ProgressDisplay(colony)
        assert "left" not in shown(display, 80)
        for _ in range(2):
            colony.run(100)
            display.print_line()
        assert ("left" in shown(display, 80)) == has_estimate


@pytest.mark.parametrize("width", [40, 60, 80, 120])
def test_the_display_fits_a_narrow_terminal(width: int) -> None:
    """It shows fewer bars, not broken ones."""
    colony, _ = new_colony()
    colony.start()
    (bars,) = (line for line in shown(ProgressDisplay(colony), width).splitlines() if "█" in line)
    assert bars.startswith("energy now")
    assert bars.count("█") + bars.count("░") == 8 * min(4, (width - 12) // 10)


def shown(display: ProgressDisplay, width: int) -> str:
    """Return the display as a terminal of this width shows it."""
    console = Console(width=width, color_system=None)
    with console.capture() as capture:
        console.print(display.table(width))
    return capture.get()
