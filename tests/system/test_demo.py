"""`make run`: a colony evolves, its robots live as processes and mate; Ctrl-C ends it at any moment, kept and said."""

import json
import os
import re
import shutil
import signal
import subprocess
from pathlib import Path

import psutil
import pytest

from tests.support.paths import ROOT
from tests.support.process import Process, wait_until
from tests.support.process_colony import colony, settings

SMALL = ("demo", "-n", "3", "--no-dashboard", "--hz", "50", *settings("generations=100"))

pytestmark = pytest.mark.timeout(900)  # the first processes on a machine wait for the compiler


def children_of(process: Process) -> list[psutil.Process]:
    return psutil.Process(process.pid).children(recursive=True)


def test_a_colony_evolves_lives_and_mates_and_ctrl_c_says_so(tmp_path: Path) -> None:
    """In three sentences and one figure; robots of the evolution live on, and no process is left."""
    folder = tmp_path / "run"
    with colony(tmp_path) as made:
        demo = made.start("demo", *SMALL, "--seconds", "1", "--out", str(folder))
        demo.wait_for("the first to mate", within_s=250.0)
        left = children_of(demo)
        demo.signal(signal.SIGINT)
        assert demo.wait(120.0) == 0, demo.output
        wait_until(lambda: not any(child.is_running() for child in left), "no process is left")
    output = demo.output
    assert re.search(r"generation \d+: matings an agent \d", output)
    assert "subpopulations of the first 3 of 4 robots" in output
    *_, evolved, mated, where, figure = output.strip().splitlines()
    assert re.fullmatch(
        r"In \d+ generations matings an agent went from [\d.]+ to [\d.]+\.", evolved
    )
    assert re.match(r"3 robots, each its own process, lived on for \d+ s and mated .*robots", mated)
    assert where.endswith(f"crcolony launch --out {folder}/live")
    path = Path(figure.removeprefix("figure: "))
    assert path.read_bytes().startswith(b"\x89PNG")
    assert "Traceback" not in output


def test_ctrl_c_while_it_evolves_keeps_what_evolved(tmp_path: Path) -> None:
    """The second part does not start, and the run can go on."""
    folder = tmp_path / "run"
    with colony(tmp_path) as made:
        demo = made.start("demo", *SMALL, "--seconds", "600", "--out", str(folder))
        demo.wait_for("generation 1:", within_s=250.0)
        demo.signal(signal.SIGINT)
        assert demo.wait(120.0) == 0, demo.output
    assert not (folder / "live").exists()
    assert json.loads((folder / "evolved" / "run.json").read_text())["status"] == "stopped"
    assert "No robot has lived as a process of its own yet." in demo.output
    assert f"crcolony launch --from {folder}/evolved" in demo.output
    assert "Traceback" not in demo.output


def test_the_minutes_count_from_the_first_tick(tmp_path: Path) -> None:
    """Both parts together end by themselves; a launch counts likewise."""
    with colony(tmp_path) as made:
        options = ("--seconds", "1", "--minutes", "0.25", "--out", str(tmp_path / "run"))
        demo = made.start("demo", *SMALL, *options)
        assert demo.wait(280.0) == 0, demo.output
    lived = re.search(r"lived on for (\d+) s", demo.output)
    assert lived is not None, demo.output
    assert int(lived[1]) <= 15


@pytest.mark.skipif(shutil.which("make") is None, reason="there is no make")
def test_make_run_is_the_demo(tmp_path: Path) -> None:
    """With its folder and its minutes."""
    printed = subprocess.run(
        [
            "make",
            "--no-print-directory",
            "-n",
            "-o",
            ".venv/run.stamp",
            "run",
            "OUT=my runs/1",
            "MINUTES=2",
        ],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
        env={
            name: value
            for name, value in os.environ.items()
            if not name.startswith(("MAKE", "MFLAGS"))
        },
    )
    assert printed.stdout.split("crcolony ")[1].strip() == 'demo --out "my runs/1" --minutes 2'
