"""The claims about hierarchies are measured rightly: rows that were made up show what holds and what does not."""

from collections.abc import Mapping
from itertools import product

import numpy as np
import pytest

from crcolony.experiments.framework.experiment import CONDITION, SEED, Row
from crcolony.experiments.framework.registration import parse_registration, registration_text
from crcolony.experiments.hierarchies_claims import (
    CHANGES,
    DARWINIAN,
    DRIFT,
    EDGE,
    ENVIRONMENTS,
    IN_SIGHT,
    INHERITANCES,
    LAMARCKIAN,
    LONG_LIVED,
    LONG_LIVES,
    MEASURES,
    OUT_OF_SIGHT,
    SENSES,
    WALL_IN_VIEW,
    WALLED,
    condition_of,
    variance_between,
)

CLAIMS = {claim.id: claim for claim in parse_registration(registration_text("hierarchies")).claims}
SEEDS = 12


def made_up(
    advantages: Mapping[str, float],
    primitives: Mapping[str, float],
    specific: float = 1.0,
) -> list[Row]:
    """Return rows of runs: how far Lamarckian ones are ahead by condition, primitives by inheritance of 3 in drift.

    Edges differ between environments by `specific`, and between runs at random.
    """
    rng = np.random.default_rng(0)
    rows: list[Row] = []
    for seed in range(1, SEEDS + 1):
        drifted: Row = {CONDITION: DRIFT, SEED: seed}
        rows.append(drifted | {"primitives_per_situation": 3.0 + 0.1 * rng.standard_normal()})
        cells: list[tuple[str, ...]] = [(name,) for name in ENVIRONMENTS]
        cells += [(name, LONG_LIVES) for name in LONG_LIVED]
        cells += product(CHANGES, SENSES)
        for cell, inheritance in product(cells, INHERITANCES):
            level = advantages.get(condition_of(*cell), 1.0) if inheritance == LAMARCKIAN else 1.0
            row: Row = {CONDITION: condition_of(*cell, inheritance), SEED: seed}
            for column in ("fitness_end", "fitness_late"):
                row[column] = 20.0 * level + 0.2 * rng.standard_normal()
            row["primitives_per_situation"] = primitives[inheritance] + 0.1 * rng.standard_normal()
            for edge, name in enumerate(ENVIRONMENTS):
                row[f"{EDGE}Root {edge}"] = specific * (cell == (name,)) + rng.random()
            rows.append(row)
    return rows


AS_CLAIMED = made_up(
    {WALLED: 1.2, condition_of(WALL_IN_VIEW, LONG_LIVES): 1.2, "conflicting, unsensed": 0.8},
    {DARWINIAN: 2.0, LAMARCKIAN: 2.4},
)
OTHERWISE = made_up(
    {
        IN_SIGHT: 1.2,
        condition_of(IN_SIGHT, LONG_LIVES): 1.2,
        **{condition_of(*cell): 0.8 for cell in product(CHANGES, SENSES)},
        "conflicting, unsensed": 1.1,
    },
    {DARWINIAN: 3.0, LAMARCKIAN: 3.4},
    specific=0.0,
)


@pytest.mark.parametrize("claim", MEASURES)
def test_a_claim_holds_where_it_does_and_not_elsewhere(claim: str) -> None:
    """Each of them, with a statistic for people."""
    found = MEASURES[claim](CLAIMS[claim], AS_CLAIMED)
    assert found.verdict == "reproduced", found
    assert found.p < 0.05
    assert found.statistic
    assert MEASURES[claim](CLAIMS[claim], OTHERWISE).verdict == "not"


def test_two_seeds_are_measured_without_a_verdict_for_them() -> None:
    """Intervals and p are not known."""
    few = [row for row in AS_CLAIMED if int(row[SEED]) <= 2]
    for claim, measure in MEASURES.items():
        assert measure(CLAIMS[claim], few).runs > 0


def test_minimal_in_one_environment_is_minimal_in_part() -> None:
    """The estimate is that of the worst."""
    rows = [
        row | {"primitives_per_situation": 3.5}
        if row[CONDITION] == condition_of(OUT_OF_SIGHT, DARWINIAN)
        else row
        for row in AS_CLAIMED
    ]
    found = MEASURES["minimal-darwinian"](CLAIMS["minimal-darwinian"], rows)
    assert found.verdict == "partly"
    assert found.estimate == pytest.approx(3.5 / 3.0, abs=0.05)


def test_the_share_of_variance_between_groups_is_that_of_a_table_by_hand() -> None:
    """Means 1 and 3 around 2, and 1 to either side: 4 of 8; all of it without spread, none without difference."""
    groups = np.array([0, 0, 1, 1])
    assert variance_between(np.array([[0.0], [2.0], [2.0], [4.0]]), groups) == pytest.approx(0.5)
    assert variance_between(np.array([[1.0], [1.0], [3.0], [3.0]]), groups) == pytest.approx(1.0)
    assert variance_between(np.zeros((4, 2)), groups) == 0.0
