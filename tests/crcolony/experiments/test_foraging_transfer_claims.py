"""The claims about foraging are judged as they were registered, whatever the runs show."""

from typing import Any

import numpy as np
import pytest

from crcolony.experiments.foraging_transfer_claims import BOTH, MEASURES, META_ALONE
from crcolony.experiments.framework.catalogue import summaries
from crcolony.experiments.framework.experiment import Row
from crcolony.experiments.framework.similar_curves import THIRDS

CLAIMS = {claim.id: claim for claim in summaries()["foraging-transfer"].claims}
RUNS = 8
NOISE = np.linspace(-0.1, 0.1, RUNS)


def verdict(claim: str, both: dict[str, Any], alone: dict[str, Any] | None = None) -> str:
    """Return the verdict on rows with these columns, each one number or one for each run."""
    rows: list[Row] = []
    for condition, columns in ((BOTH, both), (META_ALONE, alone or {})):
        for k in range(RUNS):
            row: Row = {"condition": condition, "seed": k + 1}
            row |= {name: float(np.broadcast_to(v, RUNS)[k]) for name, v in columns.items()}
            rows.append(row)
    return MEASURES[claim](CLAIMS[claim], rows).verdict


@pytest.mark.parametrize(
    ("others", "expected"),
    [
        ((10.5, 10.5, 9.7), "reproduced"),
        ((8.5, 10.5, 11.0), "partly"),
        ((8.0, 8.0, 8.0), "not"),
        ((13.0, 13.0, 13.0), "not"),
    ],
)
def test_curves_are_similar_in_each_third(
    others: tuple[float, float, float], expected: str
) -> None:
    """A worse start and a better end are similar in part; better all along is not similar."""
    for claim, body in (("similar-curves", "worn"), ("similar-curves-delayed", "delayed")):
        columns: dict[str, Any] = {"life_own": 30.0 + NOISE, f"life_{body}": sum(others) - NOISE}
        for third, other in zip(THIRDS, others, strict=True):
            columns |= {f"{third}_own": 10.0 + NOISE, f"{third}_{body}": other - NOISE}
        assert verdict(claim, columns) == expected


@pytest.mark.parametrize(
    ("claim", "column"),
    [
        ("shaping-learns-more", "life_own"),
        ("shaping-transfers", "life_worn"),
        ("shaping-transfers-delayed", "life_delayed"),
    ],
)
def test_shaping_must_capture_more(claim: str, column: str) -> None:
    """Significantly, in pairs."""
    for alone, expected in ((20.0, "reproduced"), (40.0, "not")):
        assert verdict(claim, {column: 30.0 + NOISE}, {column: alone - NOISE}) == expected


def test_greedy_is_a_tenth_of_the_temperature() -> None:
    """Lower, but not so low, is reproduced in part."""
    for found, expected in ((0.02, "reproduced"), (0.2, "partly"), (0.5, "not")):
        own = {"temperature_first": 0.4 + NOISE, "temperature_end": found + 0.1 * NOISE}
        assert verdict("greedy", own) == expected


def test_lambda_is_small_beyond_drift() -> None:
    """Below the mean of a neutral gene, but not small, it is reproduced in part."""
    for found, expected in ((0.1, "reproduced"), (0.35, "partly"), (0.6, "not")):
        own = {"lambda_end": found + 0.1 * NOISE}
        assert verdict("small-lambda", own, {"lambda_end": 0.5}) == expected
