"""`crcolony experiment`: a result of the thesis by one command."""

import json
from pathlib import Path

import pytest

from crcolony.cli import main
from crcolony.experiments.framework.catalogue import summaries
from crcolony.experiments.framework.registration import registered_names
from tests.support.command_line import Refused, run_command


def test_all_experiments_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    """With what they show; without a name, too."""
    assert main(["experiment", "--list"]) == 0
    listed = capsys.readouterr().out
    assert main(["experiment"]) == 0
    assert capsys.readouterr().out == listed
    assert [line.partition(":")[0] for line in listed.splitlines()] == registered_names()


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("experiment learning", "there is no experiment 'learning'; did you mean learning-ability"),
        ("experiment learning-ability --seeds 1", "--seeds 1: must be at least 2"),
        ("experiment learning-ability --seeds -1", "--seeds -1: must be from 1"),
        ("experiment learning-ability --seed -1", "--seed -1: must be from 0"),
        ("experiment learning-ability --workers 0", "--workers 0: must be at least 1"),
        ("experiment learning-ability --resume", "--resume needs --out"),
        (
            "experiment learning-ability --resume --out new",
            "new: there is nothing to resume",
        ),
        ("experiment learning-ability --executor dask", "--executor dask needs --scheduler"),
        ("experiment learning-ability --scheduler x", "--scheduler is for --executor dask"),
        ("experiment learning-ability --executor cloud", "invalid choice: 'cloud'"),
        ("experiment learning-ability --list", "--list is without a NAME"),
    ],
)
def test_wrong_options_are_refused_in_one_line(words: str, line: str, refused: Refused) -> None:
    """The line names the option, and the reason."""
    assert line in refused(words)


def test_an_experiment_runs_in_processes_and_prints_its_claims(tmp_path: Path) -> None:
    """The quick form of a real one: two seeds, and everything that is left behind."""
    words = ("experiment", "learning-ability", "--quick", "--seeds", "2", "--workers", "1")
    done = run_command(*words, "--out", "out", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert "4 of 4: " in done.stdout
    assert "parity: " in done.stdout
    assert "nothing of its claims" in done.stdout
    written = json.loads((tmp_path / "out" / "claims.json").read_text())
    assert len(written["claims"]) == len(summaries()["learning-ability"].claims)
    assert (tmp_path / "out" / "learning-ability.png").stat().st_size > 10_000
