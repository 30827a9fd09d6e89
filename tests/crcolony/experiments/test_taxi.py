"""A run of the taxi tells its learning curve, and what came of it."""

import numpy as np
import pytest

from crcolony.experiments.framework.experiment import Plan, Row
from crcolony.experiments.taxi import COLUMNS, EXPERIMENT, STEPS, WINDOW, draw, run
from crcolony.experiments.taxi_claims import CONVENTIONS, IN_ADDITION, LEARNERS, condition_of


@pytest.fixture(scope="module")
def rows() -> list[Row]:
    """Return the rows of one seed."""
    return [
        {"condition": condition_of(learner, convention), "seed": 1, **row}
        for learner in LEARNERS
        for convention in CONVENTIONS
        for row in run(learner, convention, 1)
    ]


def test_a_run_has_a_point_for_every_window_and_a_row_of_results(rows: list[Row]) -> None:
    """All of their columns are in the data dictionary."""
    own = [row for row in rows if row["condition"] == condition_of("abstract", IN_ADDITION)]
    assert [row["steps"] for row in own[:-1]] == list(range(WINDOW, STEPS + 1, WINDOW))
    assert all(set(row) - {"condition", "seed"} <= COLUMNS.keys() for row in rows)
    assert own[-1]["greedy_optimal"] == 1.0
    assert own[-1]["example_value"] == pytest.approx(10.0)
    assert own[-2]["mean_return"] == pytest.approx(6.93, abs=0.5)


def test_a_run_is_the_same_for_the_same_seed() -> None:
    """And another for another."""
    assert run("plain", IN_ADDITION, 3) == run("plain", IN_ADDITION, 3)
    assert run("plain", IN_ADDITION, 3) != run("plain", IN_ADDITION, 4)


def test_every_learner_drives_in_both_conventions() -> None:
    """Six conditions, of every seed one run each."""
    jobs = EXPERIMENT.jobs(Plan([7, 8]))
    assert len(jobs) == 2 * 6
    assert len({job.condition for job in jobs}) == 6


def test_the_figure_has_a_curve_of_every_learner(rows: list[Row]) -> None:
    """In a panel of each convention, with the optimum."""
    figure = draw(rows)
    assert [len(panel.lines) for panel in figure.axes] == [4, 4]
    best = [np.asarray(panel.lines[-1].get_ydata())[0] for panel in figure.axes]
    assert best == pytest.approx([7.93, 6.93])
