"""The claims about the taxi are judged as they were registered, whatever the runs show."""

from typing import Any

import numpy as np
import pytest

from crcolony.experiments.framework.catalogue import summaries
from crcolony.experiments.framework.experiment import Row
from crcolony.experiments.taxi_claims import (
    ABSTRACT,
    CONVENTIONS,
    EXAMPLE,
    FLAT,
    IN_ADDITION,
    IN_PLACE,
    LEARNERS,
    MEASURES,
    PLAIN,
    condition_of,
)

CLAIMS = {claim.id: claim for claim in summaries()["taxi"].claims}
RUNS = 8
NOISE = np.linspace(-0.1, 0.1, RUNS)


def rows_with(changes: dict[tuple[str, str], dict[str, Any]]) -> list[Row]:
    """Return rows that meet most claims, with changes for learners in a convention: numbers, or one for each run."""
    rows: list[Row] = []
    for convention in CONVENTIONS:
        best = 7.93 if convention == IN_PLACE else 6.93
        for learner in LEARNERS:
            columns: dict[str, Any] = {
                "entries": {FLAT: 3000, PLAIN: 14000, ABSTRACT: 632}[learner],
                "final_greedy_return": best,
                "greedy_optimal": 1.0,
                "steps_to_optimum": {FLAT: 100.0, PLAIN: 80.0, ABSTRACT: 30.0}[learner] + NOISE**2,
                "return_settled": best + NOISE,
                "return_first": {FLAT: -900.0, PLAIN: -300.0, ABSTRACT: -200.0}[learner] + NOISE,
            }
            if learner == ABSTRACT:
                columns |= {name: known for name, (_, known) in EXAMPLE.items()}
            columns |= changes.get((learner, convention), {})
            for k in range(RUNS):
                row: Row = {"condition": condition_of(learner, convention), "seed": k + 1}
                for name, values in columns.items():
                    value = np.broadcast_to(values, RUNS)[k]
                    row[name] = int(value) if name == "entries" else float(value)
                rows.append(row)
    return rows


def verdict(claim: str, changes: dict[tuple[str, str], dict[str, Any]] | None = None) -> str:
    return MEASURES[claim](CLAIMS[claim], rows_with(changes or {})).verdict


@pytest.mark.parametrize("column", EXAMPLE)
def test_every_term_of_the_example_counts(column: str) -> None:
    """One that is off in a single run, and the claim is not met."""
    assert verdict("example") == "reproduced"
    off = EXAMPLE[column][1] + np.where(np.arange(RUNS) == 3, 1e-3, 0.0)
    assert verdict("example", {(ABSTRACT, IN_ADDITION): {column: off}}) == "not"


def test_the_numbers_of_entries_are_exact() -> None:
    """All three of them."""
    assert verdict("table-entries") == "reproduced"
    for learner in LEARNERS:
        assert verdict("table-entries", {(learner, IN_PLACE): {"entries": 633}}) == "not"


@pytest.mark.parametrize(
    ("claim", "convention"),
    [("optimum-in-place", IN_PLACE), ("optimum-in-addition", IN_ADDITION)],
)
def test_the_optimum_is_to_be_reached_from_every_start_in_every_run(
    claim: str, convention: str
) -> None:
    """By the learner with abstraction alone it is reached in part."""
    missed = {"greedy_optimal": np.where(np.arange(RUNS) == 0, 0.99, 1.0)}
    assert verdict(claim) == "reproduced"
    assert verdict(claim, {(PLAIN, convention): missed}) == "partly"
    assert verdict(claim, {(ABSTRACT, convention): missed}) == "not"
    assert verdict(claim, {(ABSTRACT, convention): {"final_greedy_return": 7.5}}) == "not"


def test_a_difference_must_be_significant_in_both_conventions() -> None:
    """In one of them it is reproduced in part."""
    as_good = {"return_first": -900.0 + NOISE[::-1]}
    assert verdict("better-start") == "reproduced"
    assert verdict("better-start", {(PLAIN, IN_PLACE): as_good}) == "partly"
    both = {(PLAIN, IN_PLACE): as_good, (PLAIN, IN_ADDITION): as_good}
    assert verdict("better-start", both) == "not"


def test_fastest_is_less_than_half_of_the_steps_of_the_faster_other() -> None:
    """Fewer steps, but not half as many, are fastest in part."""
    assert verdict("abstraction-is-fastest") == "reproduced"
    for steps, expected in ((60.0, "partly"), (90.0, "not")):
        changes = {(ABSTRACT, IN_ADDITION): {"steps_to_optimum": steps + NOISE}}
        assert verdict("abstraction-is-fastest", changes) == expected


def test_the_level_must_surely_be_above_the_threshold() -> None:
    """With its whole interval; with its mean alone it is in part."""
    for mean, expected in ((7.7, "reproduced"), (7.605, "partly"), (7.5, "not")):
        changes = {(ABSTRACT, IN_PLACE): {"return_settled": mean + NOISE}}
        assert verdict("abstraction-level", changes) == expected
