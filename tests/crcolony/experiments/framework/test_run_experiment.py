"""An experiment runs every job once, loses nothing that has finished, and says what it found."""

import json
import os
import signal
from collections.abc import Callable
from pathlib import Path

import pytest

from crcolony.experiments.framework.catalogue import ExperimentError
from crcolony.experiments.framework.experiment import Row
from crcolony.experiments.framework.run_experiment import Request, run_experiment
from crcolony.experiments.framework.tidy_table import read_rows
from crcolony.storage.files import FolderError
from tests.support.fake_experiment import REGISTRATION, fake_experiment, here_and_now, number

ROWS = [
    {"condition": condition, "seed": seed, **number(condition, seed)}
    for seed in (1, 2, 3, 4)
    for condition in ("control", "treated")
]


def run(
    out: Path | None,
    job: Callable[[str, int], Row] = number,
    seeds: int | None = None,
    first_seed: int | None = None,
    is_quick: bool = False,
    is_resumed: bool = False,
    name: str = "fake",
) -> int:
    request = Request(seeds, first_seed, is_quick, out, is_resumed)
    return run_experiment(fake_experiment(job, name), REGISTRATION, request, here_and_now)


def complete(folder: Path) -> bool:
    return bool(json.loads((folder / "experiment.json").read_text())["is_complete"])


def test_a_run_leaves_data_claims_and_figure(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As many seeds as are registered, every condition once; the claims are printed beside what was measured."""
    assert run(tmp_path / "out") == 0
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "claims.json",
        "claims.toml",
        "data_dictionary.json",
        "experiment.json",
        "fake.png",
        "jobs.jsonl",
        "made_by.toml",
        "rows.parquet",
    ]
    assert read_rows(tmp_path / "out") == ROWS
    assert complete(tmp_path / "out")
    printed = capsys.readouterr().out
    assert f"fake: 8 runs, seeds 1 to 4, into {tmp_path}/out" in printed
    assert "8 of 8: treated, seed 4" in printed
    assert "larger: reproduced\n" in printed
    assert "the first" not in printed


def test_what_is_asked_for_is_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Other seeds; quick ones are marked, in what is printed and in the folder."""
    run(tmp_path / "out", seeds=2, first_seed=7, is_quick=True)
    assert [row["seed"] for row in read_rows(tmp_path / "out")] == [7, 7, 8, 8]
    assert json.loads((tmp_path / "out" / "experiment.json").read_text())["is_quick"]
    assert json.loads((tmp_path / "out" / "claims.json").read_text())["is_quick"]
    printed = capsys.readouterr().out
    assert "fake: 4 runs, seeds 7 to 8, quick: no claims" in printed
    assert "nothing of its claims" in printed


def test_without_a_folder_runs_are_numbered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As those of other commands are."""
    monkeypatch.chdir(tmp_path)
    run(None)
    assert complete(tmp_path / "runs" / "1")


class Failing:
    """A job that does something at one condition and seed."""

    def __init__(self, do: Callable[[], object]) -> None:
        self.do = do
        self.called: list[tuple[str, int]] = []

    def __call__(self, condition: str, seed: int) -> Row:
        self.called.append((condition, seed))
        if (condition, seed) == ("treated", 2):
            self.do()
        return number(condition, seed)


def test_a_run_that_is_stopped_goes_on_where_it_was(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Ctrl-C starts no more; --resume runs the rest, and ends as if it had not been stopped."""
    out = tmp_path / "out"
    before = signal.getsignal(signal.SIGINT)
    assert run(out, Failing(lambda: os.kill(os.getpid(), signal.SIGINT))) == 0
    assert signal.getsignal(signal.SIGINT) == before
    printed = capsys.readouterr().out
    assert f"stopped; resume with: crcolony experiment fake --resume --out {out}" in printed
    assert not (out / "rows.parquet").exists()
    assert not complete(out)
    rest = Failing(lambda: None)
    assert run(out, rest, is_resumed=True) == 0
    assert rest.called == [(str(row["condition"]), row["seed"]) for row in ROWS[4:]]
    assert read_rows(out) == ROWS


def test_a_bug_in_a_job_is_not_hidden_and_loses_nothing(tmp_path: Path) -> None:
    """What had finished is there when the bug is mended."""

    def fail() -> None:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        run(tmp_path, Failing(fail))
    rest = Failing(lambda: None)
    run(tmp_path, rest, is_resumed=True)
    assert len(rest.called) == 5
    assert read_rows(tmp_path) == ROWS


def test_a_complete_run_is_only_reported_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """With --resume; the same lines, and no job is run."""
    run(tmp_path)
    first = capsys.readouterr().out
    idle = Failing(lambda: None)
    run(tmp_path, idle, is_resumed=True, seeds=4)
    assert idle.called == []
    assert capsys.readouterr().out.splitlines()[-8:] == first.splitlines()[-8:]


def test_what_does_not_fit_the_folder_is_refused(tmp_path: Path) -> None:
    """Another experiment, other seeds, or none to resume; the line says what was there, and nothing is changed."""
    run(tmp_path / "out", seeds=2)
    with pytest.raises(FolderError, match="to go on with it: crcolony experiment fake --resume"):
        run(tmp_path / "out")
    for refused, line in (
        ({"seeds": 3}, "another value of --seeds: it was 2"),
        ({"first_seed": 3}, "another value of --seed: it was 1"),
        ({"is_quick": True}, "another value of --quick: it was False"),
        ({"name": "other"}, "another value of the experiment: it was fake"),
    ):
        with pytest.raises(FolderError, match=line):
            run(tmp_path / "out", is_resumed=True, **refused)
    with pytest.raises(FolderError, match="there is nothing to resume"):
        run(tmp_path / "new", is_resumed=True)
    assert not (tmp_path / "new").exists()
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "thesis.tex").touch()
    with pytest.raises(FolderError, match="not empty"):
        run(tmp_path / "thesis")


def test_a_statistic_needs_two_seeds(tmp_path: Path) -> None:
    """Before anything is run, or made."""
    with pytest.raises(ExperimentError, match="--seeds 1: must be at least 2; its claims are"):
        run(tmp_path / "out", seeds=1)
    assert not (tmp_path / "out").exists()


def test_runs_of_another_version_are_refused(tmp_path: Path) -> None:
    """Whose experiment has other conditions."""
    run(tmp_path)
    journal = tmp_path / "jobs.jsonl"
    journal.write_text(journal.read_text().replace('"treated"', '"mistreated"'))
    with pytest.raises(FolderError, match="holds runs that fake does not have"):
        run(tmp_path, is_resumed=True)
