"""How far an experiment is, and when it ends, is said at the pace of this start."""

import io

from rich.console import Console

from crcolony.experiments.framework.experiment_progress import JobProgress


def test_lines_tell_what_finished_and_when_all_will() -> None:
    """The first and the last at once, others no more often than every five seconds; earlier runs do not count."""
    now = 100.0
    output = io.StringIO()
    progress = JobProgress(Console(file=output), 10, 6, lambda: now)
    with progress.show():
        for passed_s in (30.0, 31.0, 60.0, 61.0):
            now = 100.0 + passed_s
            progress.add(("central", 3))
    assert output.getvalue().splitlines() == [
        "7 of 10: central, seed 3; 1 min 30 s left",
        "9 of 10: central, seed 3; 20 s left",
        "10 of 10: central, seed 3",
    ]


def test_a_terminal_has_a_bar() -> None:
    """With the number of runs, and the time that is left."""
    output = io.StringIO()
    console = Console(file=output, force_terminal=True, width=100)
    now = 0.0
    progress = JobProgress(console, 2, 0, lambda: now)
    with progress.show():
        now = 30.0
        progress.add(("central", 3))
    shown = output.getvalue()
    assert "1/2" in shown
    assert "30 s left" in shown
