"""At the end of a colony of processes its results are written, and a report says what happened."""

import csv
import io
import json
import os
import signal
from pathlib import Path

import pytest
from rich.console import Console

from crcolony.evolution.history import Mated
from crcolony.results import run_report
from crcolony.results.run_report import print_run_report
from crcolony.shutdown import ShutdownSignal
from tests.support.run_folders import rows_of
from tests.support.small_colony import Recorder, live, new_colony, small
from tests.support.stored_colony import id_of, write_robots


@pytest.fixture(scope="module")
def recorder() -> Recorder:
    """Return the history of a small in-process colony."""
    colony, recorder = new_colony()
    colony.start()
    live(colony)
    return recorder


def report_of(folder: Path) -> list[str]:
    """Return the lines of a folder's report."""
    text = io.StringIO()
    with ShutdownSignal() as stop:
        print_run_report(Console(file=text, width=80), folder, small(), stop)
    return text.getvalue().splitlines()


class LostTerminal(io.StringIO):
    """Where nothing can be printed any more."""

    def write(self, _: str) -> int:
        raise OSError("Input/output error")


def test_results_are_written_before_anything_is_said(recorder: Recorder, tmp_path: Path) -> None:
    """A report to a terminal that was closed fails, but history and table are there."""
    (tmp_path / "config.toml").touch()
    write_robots(tmp_path, recorder.events, 4)
    with ShutdownSignal() as stop, pytest.raises(OSError):
        print_run_report(Console(file=LostTerminal()), tmp_path, small(), stop)
    assert json.loads((tmp_path / "run.json").read_text())["history_hash"] == str(recorder.hash)
    assert (tmp_path / "history.sqlite").exists()
    assert (tmp_path / "generations.csv").exists()


def test_a_second_signal_leaves_out_the_figures_alone(
    recorder: Recorder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whether it comes before they are drawn or meanwhile; a line says how to draw them."""
    (tmp_path / "config.toml").touch()
    write_robots(tmp_path, recorder.events, 4)
    calls: list[Path] = []

    def draw(folder: Path) -> None:
        calls.append(folder)
        os.kill(os.getpid(), signal.SIGINT)
        pytest.fail("drawing was not interrupted")

    monkeypatch.setattr(run_report, "draw_plots", draw)
    for before in (1, 2):
        text = io.StringIO()
        with ShutdownSignal() as stop:
            for _ in range(before):
                os.kill(os.getpid(), signal.SIGTERM)
            print_run_report(Console(file=text, width=80), tmp_path, small(), stop)
        lines = text.getvalue().splitlines()
        assert f"no plots were drawn: crcolony plot {tmp_path} draws them" in lines
        assert lines[-1] == f"history hash: {recorder.hash}"
        assert (tmp_path / "generations.csv").exists()
    assert calls == [tmp_path], "after two signals drawing is not even begun"


@pytest.mark.parametrize("name", ["robot.sqlite", "memory.sqlite"])
def test_results_are_those_of_the_robots_files(
    recorder: Recorder, tmp_path: Path, name: str
) -> None:
    """History, hash, table, figures and a line for each finding, whatever the name of the files."""
    (tmp_path / "config.toml").touch()
    for path in write_robots(tmp_path, recorder.events, 4):
        path.rename(path.with_name(name))
    lines = report_of(tmp_path)
    matings = recorder.all(Mated)
    conceptions = sum(mated.conceived + mated.partner_conceived for mated in matings)
    assert lines[0].startswith(f"{len(matings)} matings led to {conceptions} offspring: robots ")
    assert lines[1].startswith("from generation 0 to 2: matings per agent ")
    assert lines[-1] == f"history hash: {recorder.hash}"
    assert rows_of(tmp_path, "matings")
    described = json.loads((tmp_path / "run.json").read_text())
    assert described["history_hash"] == str(recorder.hash)
    assert described["robots"] == [id_of(number).hex() for number in range(4)]
    with (tmp_path / "generations.csv").open(newline="") as file:
        assert [row["generation"] for row in csv.DictReader(file)] == ["0", "1", "2"]
    assert (tmp_path / "plots" / "generations.png").exists()


def test_a_robot_that_is_missing_leaves_one_sided_matings(
    recorder: Recorder, tmp_path: Path
) -> None:
    """They are counted."""
    write_robots(tmp_path, recorder.events, 4)[3].unlink()
    lines = report_of(tmp_path)
    assert any("matings are in the file of one robot only" in line for line in lines)


def test_a_damaged_file_is_named_and_nothing_is_written(recorder: Recorder, tmp_path: Path) -> None:
    """One line, no traceback."""
    path = write_robots(tmp_path, recorder.events, 4)[1]
    path.write_text("no database " * 100)
    (line,) = report_of(tmp_path)
    assert line == f"no report: {path}: not a crcolony robot file"
    assert not (tmp_path / "history.sqlite").exists()


def test_a_colony_without_generations_or_matings_has_a_report(tmp_path: Path) -> None:
    """It says so."""
    assert report_of(tmp_path)[:2] == [
        "no robots have mated yet",
        "no generation has ended yet: too few to compare",
    ]
