"""Rows are read by condition, in pairs by seed."""

import numpy as np
import pytest

from crcolony.experiments.framework.experiment import Row, pairs_of, values_of, verdict_of

ROWS: list[Row] = [
    {"condition": "one", "seed": 2, "x": 2.5},
    {"condition": "other", "seed": 2, "x": 20},
    {"condition": "one", "seed": 1, "x": 1},
    {"condition": "other", "seed": 3, "x": 30},
    {"condition": "one", "seed": 3, "y": 3},
]


def test_values_are_those_of_a_condition_in_the_order_of_seeds() -> None:
    """A row without the column has none."""
    assert values_of(ROWS, "x", "one").tolist() == [1.0, 2.5]
    with pytest.raises(KeyError, match="x of nothing"):
        values_of(ROWS, "x", "nothing")


def test_pairs_are_of_the_same_seed() -> None:
    """What has no partner is left out."""
    one, other = pairs_of(ROWS, "x", "one", "other")
    assert (one.tolist(), other.tolist()) == ([2.5], [20.0])
    assert one.dtype == np.float64
    with pytest.raises(KeyError, match="y of one and other"):
        pairs_of(ROWS, "y", "one", "other")


@pytest.mark.parametrize(
    ("is_met", "is_partly", "verdict"),
    [
        (True, True, "reproduced"),
        (True, False, "reproduced"),
        (False, True, "partly"),
        (False, False, "not"),
    ],
)
def test_a_claim_that_is_met_is_reproduced(is_met: bool, is_partly: bool, verdict: str) -> None:
    """Whatever else is said of it."""
    assert verdict_of(is_met, is_partly) == verdict
