"""The short form of the table of claims stands between two marks of a page, and nothing else of the page changes."""

import pytest

from crcolony.experiments.framework import claims_summary
from crcolony.experiments.framework.claims_summary import BEGIN, END, SummaryError, with_summary
from crcolony.experiments.framework.claims_table import TableRow
from crcolony.experiments.framework.experiment import Measured, Verdict
from crcolony.experiments.framework.experiment_folder import Description
from crcolony.experiments.framework.registration import parse_registration
from tests.support.fake_experiment import REGISTRATION


@pytest.fixture(autouse=True)
def _fakes(monkeypatch: pytest.MonkeyPatch) -> None:
    registered = {name: parse_registration(REGISTRATION) for name in ("fake", "other")}
    monkeypatch.setattr(claims_summary, "summaries", lambda: registered)
    monkeypatch.setattr(claims_summary, "command_of", lambda description: description.experiment)


def row(experiment: str, verdict: Verdict) -> TableRow:
    description = Description(experiment=experiment, seeds=4, first_seed=1, is_quick=False, jobs=8)
    measured = Measured(estimate=1.0, statistic="counted", runs=8, verdict=verdict)
    return TableRow(description, parse_registration(REGISTRATION).claims[0], measured, 0.01, "")


def test_every_experiment_has_a_line_with_its_verdicts() -> None:
    """What stood between the marks is gone, and what is around them is as it was."""
    rows = [row("fake", "reproduced"), row("other", "not"), row("fake", "partly")]
    page = with_summary(f"above\n\n{BEGIN}\nformer\n{END}\n\nbelow\n", rows)
    assert page.startswith(f"above\n\n{BEGIN}\n| what |")
    assert page.endswith(f"\n{END}\n\nbelow\n")
    assert "| 2 | 1 | 1 | 0 | `fake` |" in page
    assert "| 1 | 0 | 0 | 1 | `other` |" in page
    assert "Of 3 claims: 1 reproduced, 1 in part, 1 not." in page
    assert "former" not in page
    assert with_summary(page, rows) == page


@pytest.mark.parametrize("page", ["", BEGIN, f"{END} {BEGIN}", f"{BEGIN} {BEGIN} {END}"])
def test_a_page_without_both_marks_is_refused(page: str) -> None:
    """The line says what is missing."""
    with pytest.raises(SummaryError, match="there is no place for the short form"):
        with_summary(page, [])
