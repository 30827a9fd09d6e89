"""The claims about pseudo-realities are judged as they were registered, whatever the runs show."""

from typing import Any

import numpy as np
import pytest

from crcolony.experiments.framework.catalogue import summaries
from crcolony.experiments.framework.experiment import Measured, Row
from crcolony.experiments.pseudo_reality_claims import AT_CENTRE, AT_EDGE, MEASURES

CLAIMS = {claim.id: claim for claim in summaries()["pseudo-reality"].claims}
RUNS = 8
NOISE = np.linspace(-0.1, 0.1, RUNS)
AT_HOME = {"life_newborn_home": 40.0, "life_frozen_home": 60.0, "life_learning_on_home": 70.0}


def measured(claim: str, home: str, columns: dict[str, Any]) -> Measured:
    """Return what rows with these columns show, each a number or one for each run."""
    rows: list[Row] = []
    for condition, own in ((home, AT_HOME | columns), ("other", {})):
        for k in range(RUNS):
            row: Row = {"condition": condition, "seed": k + 1}
            rows.append(row | {name: float(np.broadcast_to(v, RUNS)[k]) for name, v in own.items()})
    return MEASURES[claim](CLAIMS[claim], rows)


@pytest.mark.parametrize(
    ("claim", "home"), [("performance-drops", AT_CENTRE), ("performance-drops-edge", AT_EDGE)]
)
def test_performance_must_drop(claim: str, home: str) -> None:
    """Significantly; a gain is no drop, and neither is what runs do not agree about."""
    for loss, expected in ((0.2, "reproduced"), (-0.2, "not"), (0.01, "not")):
        away = 60.0 * (1.0 - loss - NOISE)
        own = {"loss_frozen": loss + NOISE, "life_frozen_away": away}
        assert measured(claim, home, own).verdict == expected


@pytest.mark.parametrize(
    ("claim", "home", "kind", "where"),
    [
        ("learners-lose-less", AT_CENTRE, "newborn", ""),
        ("learners-lose-less-edge", AT_EDGE, "newborn", ""),
        ("learners-lose-less-later", AT_CENTRE, "newborn", "_delay_2"),
        ("learning-on-loses-less", AT_CENTRE, "learning_on", ""),
        ("learning-on-loses-less-edge", AT_EDGE, "learning_on", ""),
    ],
)
def test_a_kind_must_lose_a_smaller_share_than_frozen_policies(
    claim: str, home: str, kind: str, where: str
) -> None:
    """In pairs; that it loses more has a p of its own, and runs without such a world are left out."""
    for other, expected in ((0.1, "reproduced"), (0.5, "not"), (0.3, "not")):
        own = {
            f"loss_frozen{where}": 0.3 + NOISE,
            f"loss_{kind}{where}": np.where(
                np.arange(RUNS) == 0, np.nan, other - 0.5 * NOISE[::-1]
            ),
        }
        found = measured(claim, home, own)
        assert found.verdict == expected
        assert found.runs == RUNS - 1
        assert (found.effect_size > 0.9) == (other == 0.1)
        is_more = float(found.statistic.rpartition("= ")[2]) < 0.05
        assert is_more == (other == 0.5)


def test_a_newborn_overtakes_at_the_end_of_its_life() -> None:
    """If it captures more than the frozen policy then."""
    for newborn, expected in ((12.0, "reproduced"), (8.0, "not")):
        own = {"late_newborn_away": newborn + NOISE, "late_frozen_away": 10.0 - NOISE}
        assert measured("learners-overtake", AT_CENTRE, own).verdict == expected
