"""The comparison over seeds runs every condition and seed once, and can be stopped and resumed."""

import csv
import os
import signal
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path

import msgspec

from crcolony.config import Config, load
from crcolony.experiments.colonies.outcomes import read_outcome
from crcolony.experiments.colonies.paper3_survival import conditions_of
from tests.support.small_colony import SMALL

FAST = [word for setting in SMALL for word in ("--set", setting)]


def command(*words: object) -> list[str]:
    return [sys.executable, "-m", "crcolony", "evolve", *FAST, *map(str, words)]


def test_conditions_differ_in_one_setting_each() -> None:
    """Central selection, no shaping genes, or no influence of energy; everything else is the config that was given."""
    config = Config(robots=3)
    assert conditions_of(config, compare=False) == {"implicit": config}
    conditions = conditions_of(config, compare=True)
    assert list(conditions) == ["implicit", "central", "without shaping", "without health"]
    assert msgspec.structs.replace(conditions["central"], selection="implicit") == config
    unshaped = conditions["without shaping"]
    assert not unshaped.learning.shaping
    shaped = msgspec.structs.replace(unshaped.learning, shaping=True)
    assert msgspec.structs.replace(unshaped, learning=shaped) == config
    unhealthy = conditions["without health"]
    assert unhealthy.life.conception_exponent == 0.0
    life = msgspec.structs.replace(unhealthy.life, conception_exponent=1.0)
    assert msgspec.structs.replace(unhealthy, life=life) == config


def test_a_comparison_has_implicit_selection_once_whatever_is_given() -> None:
    """Central selection is compared with it, and a condition that is the config itself is not run twice."""
    central = Config(selection="central")
    assert conditions_of(central, compare=True) == conditions_of(Config(), compare=True)
    unshaped = load(None, ["learning.shaping=false"])
    assert list(conditions_of(unshaped, compare=True)) == ["implicit", "central", "without health"]


def test_all_conditions_and_seeds_are_run_written_and_reported(tmp_path: Path) -> None:
    """Eight runs, each with its folder and its row; the report names the conditions and the criteria."""
    out = tmp_path / "out"
    # so that in every run some matings fail that would not without health
    strict = ("--set", "life.initial_energy=0.5", "--set", "life.conception_exponent=3")
    words = ("--generations", 2, "--seeds", 2, "--compare", *strict, "--out", out)
    done = subprocess.run(command(*words), capture_output=True, text=True, timeout=250)
    assert done.returncode == 0, done.stderr
    with (out / "outcomes.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    runs = [(row["condition"], row["seed"]) for row in rows]
    conditions = ("implicit", "central", "without shaping", "without health")
    assert runs == [(condition, seed) for condition in conditions for seed in ("1", "2")]
    for row in rows:
        folder = out / row["condition"].replace(" ", "-") / f"seed-{row['seed']}"
        assert {k: str(v) for k, v in asdict(read_outcome(row["condition"], folder)).items()} == row
    assert len({row["history_hash"] for row in rows}) == 8
    report = (out / "comparison.md").read_text("utf-8")
    assert report in done.stdout
    assert "criterion of the default world" in report
    again = subprocess.run(command(*words), capture_output=True, text=True, timeout=250)
    assert (again.returncode, "not empty" in again.stderr) == (2, True)
    resumed = subprocess.run(
        command(*words, "--resume"), capture_output=True, text=True, timeout=250
    )
    assert report in resumed.stdout
    other = subprocess.run(
        command(*words, "--resume", "--robots", 5), capture_output=True, text=True, timeout=250
    )
    assert other.returncode == 2
    assert "not the config of this comparison" in other.stderr


def test_a_comparison_that_is_stopped_can_be_resumed(tmp_path: Path) -> None:
    """Ctrl-C ends it with a line on how to resume, and the outcomes are those of one that was not stopped."""
    words = ("--generations", 5, "--seeds", 4, "--set", "life.agents=20", "--out")
    whole = subprocess.run(
        command(*words, tmp_path / "whole"), capture_output=True, text=True, timeout=250
    )
    stopped = subprocess.Popen(
        command(*words, tmp_path / "parts"),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert stopped.stdout is not None
    assert stopped.stdout.readline().startswith("1 of 4")
    os.killpg(stopped.pid, signal.SIGINT)
    output, errors = stopped.communicate(timeout=100)
    assert (stopped.returncode, errors) == (0, "")
    assert "resume with the same command and --resume" in output
    assert not (tmp_path / "parts" / "outcomes.csv").exists()
    subprocess.run(command(*words, tmp_path / "parts", "--resume"), check=True, timeout=250)
    name = "outcomes.csv"
    assert (tmp_path / "parts" / name).read_text() == (tmp_path / "whole" / name).read_text()
    assert whole.returncode == 0
