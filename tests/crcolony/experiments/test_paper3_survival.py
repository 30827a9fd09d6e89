"""The comparison over seeds runs every arm and seed once, goes on where it stopped, and its statistics are right."""

import csv
import os
import signal
import subprocess
import sys
from dataclasses import asdict, replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from scipy import stats

from crcolony.config import Config
from crcolony.experiments.paper3_survival import conditions_of
from crcolony.experiments.statistics import format_report
from crcolony.experiments.sweep import Outcome, read_outcome
from crcolony.storage.files import FolderError
from tests.support.small_colony import SMALL

FAST = [word for setting in SMALL for word in ("--set", setting)]
OUTCOME = Outcome("implicit", 1, 0.2, 5.0, 1.0, 2.0, 0.5, 0.1, 0.4, "00")


def command(*words: object) -> list[str]:
    return [sys.executable, "-m", "crcolony", "evolve", *FAST, *map(str, words)]


def test_the_arms_differ_in_one_thing_each() -> None:
    """Central selection, or no shaping genes; everything else is the config that was given."""
    config = Config(robots=3)
    assert conditions_of(config, compare=False) == {"implicit": config}
    conditions = conditions_of(config, compare=True)
    assert list(conditions) == ["implicit", "central", "without shaping"]
    assert msgspec.structs.replace(conditions["central"], selection="implicit") == config
    unshaped = conditions["without shaping"]
    assert not unshaped.learning.shaping
    shaped = msgspec.structs.replace(unshaped.learning, shaping=True)
    assert msgspec.structs.replace(unshaped, learning=shaped) == config


def test_all_arms_and_seeds_are_run_written_and_reported(tmp_path: Path) -> None:
    """Nine runs, each with its folder and its row; the report names the arms and their ratio."""
    out = tmp_path / "out"
    words = ("--generations", 2, "--seeds", 3, "--compare", "--out", out)
    done = subprocess.run(command(*words), capture_output=True, text=True, timeout=250)
    assert done.returncode == 0, done.stderr
    with (out / "outcomes.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    runs = [(row["condition"], row["seed"]) for row in rows]
    conditions = ("central", "implicit", "without shaping")
    assert runs == [(condition, seed) for condition in conditions for seed in ("1", "2", "3")]
    for row in rows:
        folder = out / row["condition"].replace(" ", "-") / f"seed-{row['seed']}"
        assert {k: str(v) for k, v in asdict(read_outcome(row["condition"], folder)).items()} == row
    assert len({row["history_hash"] for row in rows}) == 9
    assert "implicit / central: " in done.stdout
    again = subprocess.run(command(*words), capture_output=True, text=True, timeout=250)
    assert (again.returncode, "not empty" in again.stderr) == (2, True)
    resumed = subprocess.run(
        command(*words, "--resume"), capture_output=True, text=True, timeout=250
    )
    assert sorted(resumed.stdout.splitlines()[-20:]) == sorted(done.stdout.splitlines()[-20:])
    other = subprocess.run(
        command(*words, "--resume", "--robots", 5), capture_output=True, text=True, timeout=250
    )
    assert other.returncode == 2
    assert "not the config of this comparison" in other.stderr


def test_a_comparison_that_is_stopped_goes_on_where_it_was(tmp_path: Path) -> None:
    """Ctrl-C ends it with a word on how to go on, and the outcomes are those of an undisturbed one."""
    words = ("--generations", 30, "--seeds", 4, "--set", "life.agents=30", "--out")
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


def outcomes_of(condition: str, ends: np.ndarray, lambdas: np.ndarray) -> list[Outcome]:
    return [
        replace(
            OUTCOME,
            condition=condition,
            seed=k,
            matings_end=float(end),
            mating_lambda_end=float(lambda_),
        )
        for k, (end, lambda_) in enumerate(zip(ends, lambdas, strict=True))
    ]


def test_the_report_says_what_scipy_says() -> None:
    """Means with Student's interval, the ratio with one by resampling, Mann-Whitney's and Spearman's p."""
    rng = np.random.default_rng(1)
    own, central = rng.normal(5.0, 1.0, 20), rng.normal(6.0, 1.0, 20)
    lambdas = 1.0 - 0.1 * own + rng.normal(0.0, 0.1, 20)
    lines = format_report(outcomes_of("implicit", own, lambdas) + outcomes_of("central", central, lambdas))
    text = "\n".join(lines)
    low, high = stats.t.interval(0.95, 19, own.mean(), stats.sem(own))
    assert f"{own.mean():.2f} ± {0.5 * (high - low):.2f} at the end" in text
    found = stats.spearmanr(own, lambdas)
    assert f"Spearman {found.statistic:.2f} (p = {found.pvalue:.2g})" in text
    p = stats.mannwhitneyu(own, central).pvalue
    assert f"Mann-Whitney p = {p:.2g}" in text
    assert f"implicit / central: {own.mean() / central.mean():.2f} (" in text
    interval = text.split("implicit / central: ")[1].split("(")[1].split(")")[0]
    below, above = map(float, interval.split(" to "))
    assert below < own.mean() / central.mean() < above < below + 0.4
    assert "too few runs" in "\n".join(format_report(outcomes_of("implicit", own[:2], lambdas[:2])))
    assert format_report(outcomes_of("implicit", own[:1], lambdas[:1]))


def test_a_folder_without_a_whole_run_is_refused(tmp_path: Path) -> None:
    """Its name is said."""
    with pytest.raises(FolderError, match="not the results of a finished run"):
        read_outcome("implicit", tmp_path)
