"""What has finished is on the disk, and a folder that is damaged is refused by name."""

import math
from pathlib import Path

import pytest

from crcolony.experiments.framework.experiment import Plan, Row
from crcolony.experiments.framework.experiment_folder import (
    Description,
    ExperimentFolder,
    tidy_rows,
    versions,
)
from crcolony.storage.files import FolderError
from tests.support.fake_experiment import REGISTRATION, fake_experiment

DESCRIPTION = Description("fake", 1, 2, False, 4, versions=versions())


@pytest.fixture
def folder(tmp_path: Path) -> ExperimentFolder:
    begun = ExperimentFolder(tmp_path)
    begun.begin(DESCRIPTION, REGISTRATION)
    return begun


def test_finished_jobs_are_read_back(folder: ExperimentFolder) -> None:
    """Each with its rows, in any order; NaN is a number as well."""
    rows: list[Row] = [{"number": 1.5, "word": "ö\n"}, {"number": math.inf}]
    folder.append(("treated", 2), rows)
    folder.append(("control", 1), [{"number": math.nan}])
    found = folder.read_journal()
    assert found["treated", 2] == rows
    assert math.isnan(float(found["control", 1][0]["number"]))


def test_a_line_that_a_crash_cut_short_is_no_finished_job(folder: ExperimentFolder) -> None:
    """At whatever byte; what comes after it is written on a line of its own."""
    folder.append(("control", 1), [{"number": 1}])
    path = folder.path / "jobs.jsonl"
    first = path.read_bytes()
    folder.append(("treated", 1), [{"number": 2}])
    second = path.read_bytes()[len(first) :]
    for size in range(len(second)):
        path.write_bytes(first + second[:size])
        assert list(folder.read_journal()) == [("control", 1)]
        folder.append(("treated", 2), [{"number": 3}])
        assert list(folder.read_journal()) == [("control", 1), ("treated", 2)]


def test_what_is_run_is_read_back(folder: ExperimentFolder) -> None:
    """And what was claimed of it."""
    assert folder.description() == DESCRIPTION
    assert folder.registration().claims[0].id == "larger"


@pytest.mark.parametrize("content", ["", "{}", '{"experiment": 1}', "[1]"])
def test_a_damaged_description_is_named(folder: ExperimentFolder, content: str) -> None:
    """With the reason."""
    (folder.path / "experiment.json").write_text(content)
    with pytest.raises(FolderError, match=r"experiment\.json: corrupt: "):
        folder.description()


def test_another_folder_is_no_experiment(tmp_path: Path) -> None:
    """It is named."""
    with pytest.raises(FolderError, match=r"not the results of an experiment: experiment\.json"):
        ExperimentFolder(tmp_path).description()


@pytest.mark.parametrize("line", ["nothing", "3", '{"seed": 1}'])
def test_a_damaged_journal_is_named(folder: ExperimentFolder, line: str) -> None:
    """It is not taken for a line that was cut short."""
    (folder.path / "jobs.jsonl").write_text(line + "\n")
    with pytest.raises(FolderError, match=r"jobs\.jsonl: corrupt: "):
        folder.read_journal()


def test_rows_come_in_the_order_of_the_jobs_with_condition_and_seed() -> None:
    """However the jobs finished."""
    jobs = fake_experiment().jobs(Plan([1]))
    journal: dict[tuple[str, int], list[Row]] = {
        ("treated", 1): [{"number": 2}],
        ("control", 1): [{"number": 1}, {"number": 0}],
    }
    assert tidy_rows(journal, jobs) == [
        {"condition": "control", "seed": 1, "number": 1},
        {"condition": "control", "seed": 1, "number": 0},
        {"condition": "treated", "seed": 1, "number": 2},
    ]
