"""The claims about the mountain car are judged as they were registered, whatever the runs show."""

from typing import Any

import numpy as np
import pytest

from crcolony.experiments.framework.catalogue import summaries
from crcolony.experiments.framework.experiment import Row
from crcolony.experiments.mountain_car_claims import (
    BOTH,
    MEASURES,
    META_ALONE,
    OMPAC,
    TEXTBOOK,
)

CLAIMS = {claim.id: claim for claim in summaries()["mountain-car"].claims}
RUNS = 8
NOISE = np.linspace(-0.1, 0.1, RUNS)


def verdict(claim: str, **conditions: dict[str, Any]) -> str:
    """Return the verdict on rows with these columns, each one number or one for each run."""
    names = {"both": BOTH, "alone": META_ALONE, "textbook": TEXTBOOK, "ompac": OMPAC}
    rows: list[Row] = []
    for condition, columns in conditions.items():
        for k in range(RUNS):
            row: Row = {"condition": names[condition], "seed": k + 1}
            row |= {name: float(np.broadcast_to(v, RUNS)[k]) for name, v in columns.items()}
            rows.append(row)
    return MEASURES[claim](CLAIMS[claim], rows).verdict


@pytest.mark.parametrize(
    ("claim", "column", "factor"),
    [("first-episode", "first_steps", 10.0), ("robust-policy", "robust_episode", 60.0)],
)
def test_the_factor_must_be_beyond_the_threshold(claim: str, column: str, factor: float) -> None:
    """With its whole interval; in part if only the ratio of means is."""
    textbook = {column: 200.0 * factor}
    assert verdict(claim, textbook=textbook, both={column: 150.0 + NOISE}) == "reproduced"
    assert verdict(claim, textbook=textbook, both={column: 199.0 + 100 * NOISE}) == "partly"
    assert verdict(claim, textbook=textbook, both={column: 201.0 + NOISE}) == "not"


@pytest.mark.parametrize(
    ("claim", "column"),
    [
        ("first-episode-best-run", "first_steps"),
        ("robust-policy-best-run", "robust_episode"),
    ],
)
def test_the_best_run_is_chosen_by_other_lives(claim: str, column: str) -> None:
    """It is not the run that does best in the lives that are judged."""
    found = np.array([1.0] * (RUNS - 1) + [100.0])
    chosen = {"chosen_steps": np.arange(RUNS), column: found}
    assert verdict(claim, textbook={column: 70.0}, both=chosen) == "reproduced"
    chosen["chosen_steps"] = -np.arange(RUNS)
    assert verdict(claim, textbook={column: 70.0}, both=chosen) == "not"


@pytest.mark.parametrize(
    ("claim", "column"),
    [("shaping-starts-better", "first_steps"), ("shaping-converges-sooner", "robust_episode")],
)
def test_shaping_must_be_worth_more_than_meta_parameters(claim: str, column: str) -> None:
    """By the factor of the threshold; in part if it is only better."""
    for alone, expected in ((60.0, "reproduced"), (30.0, "partly"), (9.0, "not")):
        found = verdict(claim, alone={column: alone + NOISE}, both={column: 10.0 + NOISE})
        assert found == expected


def test_a_policy_that_gets_worse_does_not_stay_robust() -> None:
    """Nor do those of most runs, if some get much worse: that is in part."""
    textbook = {"late_steps": 106.0}
    outlier = np.array([100.0] * (RUNS - 1) + [500.0])
    for late, expected in ((105.0, "reproduced"), (outlier, "partly"), (111.0, "not")):
        assert verdict("stays-robust", both={"late_steps": late}, textbook=textbook) == expected


def test_greedy_is_a_tenth_of_the_temperature() -> None:
    """Also if it is 0 in every run; lower, but not so low, is reproduced in part."""
    for early, expected in ((0.0, "reproduced"), (0.5, "partly"), (2.0, "not")):
        own = {"temperature_first": 2.0 + NOISE, "temperature_early": early + NOISE**2}
        assert verdict("greedy-early", both=own) == expected


def test_lambda_is_small_beyond_drift() -> None:
    """Below the mean of a neutral gene, but not small, it is reproduced in part."""
    for found, expected in ((0.1, "reproduced"), (0.35, "partly"), (0.6, "not")):
        assert verdict("small-lambda", both={"lambda_end": found + NOISE}) == expected


def test_lambda_is_smaller_than_without_shaping() -> None:
    """Pair by pair."""
    for alone, expected in ((0.9, "reproduced"), (0.2, "not")):
        own = {"lambda_end": 0.2 + NOISE}
        other = {"lambda_end": alone + NOISE[::-1]}
        assert verdict("shaping-needs-less-lambda", both=own, alone=other) == expected


def test_competing_learners_must_end_with_fewer_steps() -> None:
    """Than those of a textbook, beyond chance."""
    textbook = {"late_steps": 110.0 + NOISE}
    for late, expected in ((105.0 + NOISE, "reproduced"), (110.0 - NOISE[::-1] / 2, "not")):
        assert (
            verdict("ompac-learns-better", textbook=textbook, ompac={"late_steps": late})
            == expected
        )
    assert verdict("ompac-learns-better", textbook=textbook, ompac={"late_steps": 115.0}) == "not"


def test_the_learning_rate_must_fall_while_they_learn() -> None:
    """By a fifth; in part if it only falls."""
    for end, expected in ((0.7, "reproduced"), (0.9, "partly"), (1.1, "not")):
        own = {"alpha_first": 1.0 + NOISE, "alpha_end": end + NOISE}
        assert verdict("ompac-follows-learning", ompac=own) == expected


def test_newborns_must_be_slower_with_what_competition_finds() -> None:
    """By a fifth; in part if they are only slower."""
    alone = {"newborn_steps": 100.0 + NOISE}
    for steps, expected in ((130.0, "reproduced"), (110.0, "partly"), (90.0, "not")):
        ompac = {"newborn_steps": steps + NOISE}
        assert verdict("ompac-is-for-the-old", alone=alone, ompac=ompac) == expected
