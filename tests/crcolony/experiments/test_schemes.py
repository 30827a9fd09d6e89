"""Schemes are compared on the same task, and judged as registered, whatever the runs show."""

from typing import Any

import numpy as np
import pytest

from crcolony.config import Config
from crcolony.experiments.framework.catalogue import summaries
from crcolony.experiments.framework.experiment import Plan, Row
from crcolony.experiments.schemes import (
    COLUMNS,
    EXPERIMENT,
    GENERATIONS,
    SELECTIONS,
    draw,
    run_phototaxis,
    run_scheme,
)
from tests.support.small_colony import small

CLAIMS = {claim.id: claim for claim in summaries()["schemes"].claims}
RUNS = 8
NOISE = np.linspace(-0.1, 0.1, RUNS)
CONDITIONS = (*SELECTIONS, "phototaxis", "phototaxis-random", "phototaxis-turning")
CONDITIONS = (*CONDITIONS, "phototaxis-pivoting")


def rows_with(condition: str, value: Any) -> list[Row]:
    """Return rows of a condition in which every number is the same, or one for each run."""
    values = np.broadcast_to(value, RUNS)
    return [
        {"condition": condition, "seed": k, **dict.fromkeys(COLUMNS, float(values[k]))}
        for k in range(RUNS)
    ]


@pytest.mark.parametrize(
    ("claim", "ahead", "behind"),
    [
        ("ahead-of-pgta", "implicit", "pgta"),
        ("ahead-of-pega", "implicit", "pega"),
        ("ahead-of-medea", "implicit", "medea"),
        ("fed-better-than-medea", "medea", "implicit"),
        ("learning-handed-down", "ompac", "implicit"),
        ("learning-ability", "implicit", "ompac"),
        ("pairwise-learning", "gpbt_pl", "implicit"),
        ("phototaxis-evolves", "phototaxis", "phototaxis-random"),
        ("beats-pivoting", "phototaxis", "phototaxis-pivoting"),
        ("beats-turning", "phototaxis", "phototaxis-turning"),
    ],
)
def test_a_claim_holds_if_one_condition_is_clearly_ahead(
    claim: str, ahead: str, behind: str
) -> None:
    """Not if both are the same, and not the other way round."""
    judge = EXPERIMENT.measures[claim]
    for one, other, verdict in ((3.0, 1.0, "reproduced"), (1.0, 1.0, "not"), (1.0, 3.0, "not")):
        rows = rows_with(ahead, one + NOISE) + rows_with(behind, other - NOISE)
        assert judge(CLAIMS[claim], rows).verdict == verdict


def test_conditions_differ_in_selection_alone() -> None:
    """And runs in their seed: all have the same generations of the default world."""
    jobs = {(job.condition, job.seed): job.run.args for job in EXPERIMENT.jobs(Plan([3, 4]))}  # type: ignore[attr-defined]
    assert {condition for condition, _ in jobs} == set(CONDITIONS)
    for selection in SELECTIONS:
        (config,) = jobs[selection, 4]
        assert config == Config(seed=4, selection=selection, generations=GENERATIONS)


@pytest.mark.parametrize("selection", ["medea", "ompac"])
def test_a_run_of_a_scheme_gives_what_the_columns_say(selection: str) -> None:
    """With the same budget whatever the scheme, and one generation more, which is not counted."""
    config = small(f"selection={selection}", "generations=2")
    row = run_scheme(config)
    assert set(row) == {name for name in COLUMNS if not name.startswith("visits")}
    life = config.life
    assert row["robot_steps"] == 2 * config.robots * life.agents * life.slices * life.slice_steps
    assert row == run_scheme(config)


def test_a_run_in_the_pen_gives_visits_in_a_minute() -> None:
    """From the same random weights whether they evolve or not."""
    row = run_phototaxis("phototaxis-pivoting", 1, 500)
    assert set(row) == {name for name in COLUMNS if name.startswith("visits")}
    assert 3.0 < float(row["visits_last"]) < 30.0
    first = [run_phototaxis(name, 1, 5) for name in ("phototaxis", "phototaxis-random")]
    assert first[0] == first[1]


def test_the_figure_has_every_run() -> None:
    """A point for each, in the panels of its task."""
    figure = draw([row for name in CONDITIONS for row in rows_with(name, 1.0 + NOISE)])
    points = [sum(np.asarray(line.get_xdata()).size for line in a.lines) for a in figure.axes]
    assert points == [7 * RUNS] * 3 + [4 * RUNS]
