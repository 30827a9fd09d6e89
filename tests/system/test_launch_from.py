"""Evolved robots live on as processes, and as an in-process run: the same history, and the earlier run may be gone."""

import json
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import psutil
import pytest

from crcolony.results.earlier_run import read_earlier_run
from tests.support.process_colony import Colony, Process, colony, settings, wait_until

pytestmark = pytest.mark.timeout(900)  # the first processes on a machine wait for the compiler


def evolve(made: Colony, out: Path, *options: str) -> Process:
    """Run `evolve` to its end; the first one on a busy machine waits for the compiler."""
    evolved = made.start(out.name, "evolve", *options, "--no-plots", "--out", str(out))
    assert evolved.wait(250.0) == 0, evolved.output
    return evolved


def history_hash(folder: Path) -> str:
    return str(json.loads((folder / "run.json").read_text())["history_hash"])


def first_mothers(folder: Path) -> list[str]:
    """Return the mothers of the first generation of a run."""
    with closing(sqlite3.connect(folder / "history.sqlite")) as database:
        rows = database.execute("SELECT mother FROM births WHERE generation = 0 ORDER BY rowid")
        return [mother for (mother,) in rows]


@pytest.mark.parametrize("robots", [2, 6])
def test_a_lockstep_colony_from_a_run_has_the_history_of_an_in_process_one(
    tmp_path: Path, robots: int
) -> None:
    """From the same genotypes and seed; dealt out to fewer or more robots than there were."""
    run = tmp_path / "run"
    options = ["--from", str(run), "--seed", "5", "--generations", "2"]
    with colony(tmp_path) as made:
        evolve(made, run, *settings("generations=2"))
        evolve(made, tmp_path / "evolved", *options, "--robots", str(robots))
        launched = made.start(
            "launch",
            *("launch", "-n", str(robots), "--lockstep", *options),
            *("--no-plots", "--out", str(tmp_path / "launched")),
        )
        assert launched.wait(250.0) == 0, launched.output
    assert history_hash(tmp_path / "launched") == history_hash(tmp_path / "evolved")
    mothers = first_mothers(tmp_path / "launched")
    assert mothers == first_mothers(tmp_path / "evolved")
    assert all("@" in mother for mother in mothers)
    matings = launched.output.partition(" matings led to")[0].split()[-1]
    assert int(matings) >= 3, "with so few matings this shows nothing"


def test_robots_keep_what_they_began_with_when_the_run_is_gone(tmp_path: Path) -> None:
    """A robot that is killed, and a launch that is stopped and goes on, need it no more."""
    run, live = tmp_path / "run", tmp_path / "live"
    with colony(tmp_path) as made:
        evolve(made, run, *settings("generations=1"))
        command = (
            "launch",
            "-n",
            "3",
            "--hz",
            "20",
            "--generations",
            "0",
            "--no-plots",
            "--out",
            str(live),
        )
        launched = made.start("launch", *command, "--from", str(run))
        launched.wait_for("3 robots are connected")
        shutil.rmtree(run)
        victim = next(
            child
            for child in psutil.Process(launched.pid).children()
            if str(live / "robots" / "1") in child.cmdline()
        )
        victim.kill()
        launched.wait_for("robot 1")
        launched.stop(120.0)
        first = first_mothers(live)
        assert len(first) == 24
        assert all("@" in mother for mother in first)
        again = made.start("again", *command[:-2], "--out", str(live), "--from", str(run))
        again.wait_for("3 robots are connected")
        again.stop(120.0)
        assert first_mothers(live) == first


def test_a_colony_that_lives_can_be_begun_from(tmp_path: Path) -> None:
    """Its files are read while its robots write them, and it lives on."""
    live = tmp_path / "live"
    with colony(tmp_path) as made:
        launched = made.start(
            "launch",
            *("launch", "-n", "3", "--lockstep", *settings(), "--no-plots", "--out", str(live)),
        )
        wait_until(lambda: "generation" in launched.output, "the robots live")
        launched.wait_for("3 robots are connected")
        evolve(made, tmp_path / "evolved", "--from", str(live), "--generations", "1")
        assert launched.is_running
        launched.stop(120.0)
    assert all("@" in mother for mother in first_mothers(tmp_path / "evolved"))


def test_a_host_and_a_robot_alone_begin_with_robots_of_a_run(tmp_path: Path) -> None:
    """Each with its share, and a robot that is started again goes on though the run is gone."""
    run, hosted = tmp_path / "run", tmp_path / "hosted"
    with colony(tmp_path) as made:
        evolve(made, run, *settings("generations=1"))
        listen = ("--no-plots", "--listen", made.endpoint)
        host = made.start(
            "host", *("host", "-n", "2", "--from", str(run), "--out", str(hosted)), *listen
        )
        host.wait_for("slots for others", within_s=250.0)
        robot = made.start("robot", *robot_from(run, tmp_path / "alone", made))
        robot.wait_for("has body", within_s=250.0)
        robot.stop(120.0)
        shutil.rmtree(run)
        again = made.start("again", *robot_from(run, tmp_path / "alone", made))
        again.wait_for("has body", within_s=250.0)
        again.stop(120.0)
        host.stop(120.0)
    births = read_earlier_run(tmp_path / "alone", 0).subpopulations[0]
    mothers = [*first_mothers(hosted), *(born.mother for born in births)]
    assert len(mothers) == 3 * 8
    assert all(mother is not None and "@" in mother for mother in mothers)


def robot_from(run: Path, out: Path, made: Colony) -> tuple[str, ...]:
    """Return the command of a robot that begins with those of a run."""
    return ("robot", "--from", str(run), "--out", str(out), "--connect", made.endpoint)
