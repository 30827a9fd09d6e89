"""Societies are compared with those of the same seed."""

from functools import partial

import numpy as np
import pytest

from crcolony.experiments.colonies.mating_traits import by_threshold
from crcolony.experiments.colonies.trait_societies import (
    COLUMNS,
    run_societies,
    societies_of,
    society_ahead,
    trait_moves,
)
from crcolony.experiments.framework.experiment import Row
from crcolony.experiments.framework.registration import Claim
from tests.support.small_colony import small

RUNS = 8
NOISE = np.linspace(-0.02, 0.02, RUNS)


def rows_with(society: str, column: str, value: float, world: str = "default") -> list[Row]:
    """Return outcomes of a society, nearly the same in every run."""
    return [
        {"condition": world, "society": society, "seed": k, column: value * (1.0 + float(NOISE[k]))}
        for k in range(RUNS)
    ]


def claim_of(threshold: float) -> Claim:
    return Claim("id", "claim", "thesis", "quantity", "test", threshold, 2)


def test_all_societies_begin_with_the_same_founders_and_traits() -> None:
    """A row a generation each, and one of what came of it, with what the columns say."""
    societies = {
        "liberal": partial(by_threshold, threshold=0.0),
        "evolving": partial(by_threshold, threshold=None),
    }
    rows = run_societies(small("seed=2", "generations=2"), 3, societies)
    assert [row["society"] for row in rows] == ["liberal"] * 4 + ["evolving"] * 4
    assert [row.get("generation", "end") for row in rows[:4]] == [0, 1, 2, "end"]
    assert {**rows[0], "society": ""} == {**rows[4], "society": ""}
    assert set(COLUMNS) >= set().union(*rows) >= set(COLUMNS) - {"accepted", "selection"}


@pytest.mark.parametrize(("sign", "threshold"), [(1, 0.1), (-1, -0.1)])
def test_a_trait_must_move_beyond_the_threshold(sign: int, threshold: float) -> None:
    """In part if it moves at all; what other worlds show does not matter."""
    neutral = rows_with("honest", "lie_end", 0.5) + rows_with("honest", "lie_end", 9.0, "other")
    measure = partial(trait_moves, "lie", sign, "default", "lying", "honest")  # type: ignore[arg-type]
    found = [
        measure(claim_of(threshold), rows_with("lying", "lie_end", 0.5 + sign * moved) + neutral)
        for moved in (0.2, 0.05, -0.2)
    ]
    assert [one.verdict for one in found] == ["reproduced", "partly", "not"]


@pytest.mark.parametrize(("sign", "ahead"), [(1, 2.0), (-1, 0.5)])
def test_a_society_is_ahead_if_its_ratio_is_beyond_the_threshold(sign: int, ahead: float) -> None:
    """Not if both are the same, nor the other way round."""
    others = rows_with("liberal", "captures_end", 1.0)
    measure = partial(society_ahead, "captures_end", sign, "default", "choosy", "liberal")  # type: ignore[arg-type]
    found = [
        measure(claim_of(1.0), rows_with("choosy", "captures_end", value) + others).verdict
        for value in (ahead, 1.0 / ahead)
    ]
    assert found == ["reproduced", "not"]
    assert len(societies_of(others, "default")) == RUNS
    assert societies_of(others, "elsewhere") == []
