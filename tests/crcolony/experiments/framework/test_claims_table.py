"""The table of claims is made from the data alone, corrected for its tests, and refuses what is no evidence."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from crcolony.experiments.framework import claims_table
from crcolony.experiments.framework.claims_table import format_table, read_table
from crcolony.experiments.framework.experiment import Experiment, Row
from crcolony.experiments.framework.registration import Registration, parse_registration
from crcolony.experiments.framework.run_experiment import Request, run_experiment
from crcolony.experiments.framework.tidy_table import read_rows, write_rows
from crcolony.storage.files import FolderError
from tests.support.fake_experiment import REGISTRATION, fake_experiment, here_and_now, number

NAMES = ("fake", "other", "third", "fourth", "fifth")


@pytest.fixture(autouse=True)
def _fakes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let there be some experiments, each with p = 0.01."""

    def find(name: str) -> Experiment:
        return fake_experiment(name=name)

    def registered() -> dict[str, Registration]:
        tried = REGISTRATION + 'tried = "Larger numbers."'
        return {name: parse_registration(tried) for name in NAMES}

    monkeypatch.setattr(claims_table, "find_experiment", find)
    monkeypatch.setattr(claims_table, "summaries", registered)


def run(
    out: Path,
    name: str = "fake",
    job: Callable[[str, int], Row] = number,
    seeds: int | None = None,
    is_quick: bool = False,
) -> Path:
    request = Request(seeds, None, is_quick, out)
    run_experiment(fake_experiment(job, name), REGISTRATION, request, here_and_now)
    return out


def test_the_table_is_made_from_rows_and_registered_claims_alone(tmp_path: Path) -> None:
    """What else the folder holds is not read: neither journal nor what was measured then."""
    folder = run(tmp_path / "a")
    for name in ("jobs.jsonl", "claims.json", "fake.png", "data_dictionary.json"):
        (folder / name).unlink()
    (row,) = read_table([folder])
    assert row.measured.estimate == 1.5
    assert row.measured.verdict == "reproduced"
    lines = format_table([row])
    assert (
        "| The treated are larger. | They are larger. | 1.5 | 8 | d 1.50 | 0.01 | 0.01 | reproduced |"
    ) in lines
    assert "## fake" in lines
    assert any(line.endswith(" 4 seeds: `crcolony experiment fake`") for line in lines)
    assert lines[2].startswith("1 claims: 1 reproduced, 0 in part, 0 not.")


def test_p_is_corrected_for_the_number_of_tests(tmp_path: Path) -> None:
    """Five tests at 0.01 are none at 0.05: a claim that was reproduced alone is so in part."""
    rows = read_table([run(tmp_path / name, name) for name in NAMES])
    assert [row.corrected_p for row in rows] == pytest.approx([0.05] * 5)
    assert {row.measured.verdict for row in rows} == {"partly"}
    four = read_table([tmp_path / name for name in NAMES[:4]])
    assert {row.measured.verdict for row in four} == {"reproduced"}


def test_a_claim_that_does_not_reproduce_stays_with_what_was_tried(tmp_path: Path) -> None:
    """And the command names the seeds where they are not those by default."""

    def alike(condition: str, seed: int) -> Row:
        return {"number": seed}

    lines = format_table(read_table([run(tmp_path / "a", job=alike, seeds=5)]))
    assert any(line.endswith("| not reproduced |") for line in lines)
    assert any(line.endswith(" 5 seeds: `crcolony experiment fake --seeds 5`") for line in lines)
    assert lines[-1].endswith("Tried: Larger numbers.")


def test_what_is_no_evidence_is_refused_by_name(tmp_path: Path) -> None:
    """Quick, too few, incomplete, foreign, twice the same, or with rows that are missing."""
    whole = run(tmp_path / "whole")
    quick = run(tmp_path / "quick", is_quick=True)
    few = run(tmp_path / "few", seeds=2)
    incomplete = run(tmp_path / "incomplete")
    described = json.loads((incomplete / "experiment.json").read_text())
    (incomplete / "experiment.json").write_text(json.dumps({**described, "is_complete": False}))
    fewer = run(tmp_path / "fewer")
    (fewer / "rows.parquet").write_bytes((few / "rows.parquet").read_bytes())
    (tmp_path / "foreign").mkdir()
    for folders, line in (
        ([quick], "quick: a quick run, whose results are no claims"),
        ([few], "few: has 2 seeds, the claim 'larger' asks for 4"),
        ([incomplete], "incomplete: not complete; crcolony experiment fake --resume --out"),
        ([fewer], "fewer: not the rows of all 8 runs of fake"),
        ([tmp_path / "foreign"], "foreign: not the results of an experiment"),
        ([whole, whole / "."], "the experiment fake is in"),
    ):
        with pytest.raises(FolderError, match=line):
            read_table(folders)


def test_a_claim_that_is_not_measured_any_more_is_named(tmp_path: Path) -> None:
    """As after an experiment was changed."""
    folder = run(tmp_path / "a")
    claims = folder / "claims.toml"
    claims.write_text(claims.read_text().replace('"larger"', '"smaller"'))
    with pytest.raises(FolderError, match="the claim 'smaller' is not one of fake any more"):
        read_table([folder])


def test_rows_of_another_version_are_named(tmp_path: Path) -> None:
    """A column that is measured may be missing in them."""
    folder = run(tmp_path / "a")
    rows = [
        {name: row[name] for name in ("condition", "seed", "word")} for row in read_rows(folder)
    ]
    write_rows(folder, rows, fake_experiment().columns)
    with pytest.raises(
        FolderError, match="a: rows of another version of fake: no number of treated and control"
    ):
        read_table([folder])
