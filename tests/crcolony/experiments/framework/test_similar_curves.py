"""Two learning curves are similar if each third of them is equal within a margin."""

import numpy as np
import pytest

from crcolony.experiments.framework.experiment import Row
from crcolony.experiments.framework.registration import Claim
from crcolony.experiments.framework.similar_curves import THIRDS, measure_similar_curves

CLAIM = Claim("similar", "a claim", "a thesis", "a quantity", "a test", 0.1, 8)
NOISE = np.linspace(-0.1, 0.1, 8)


def rows_of(others: tuple[float, float, float]) -> list[Row]:
    """Return runs of two conditions: thirds of 10 packs in a body, and others in another one."""
    rows: list[Row] = []
    for k, noise in enumerate(NOISE.tolist()):
        row: Row = {"condition": "evolved", "seed": k, "packs life own": 30.0 + noise}
        row["packs life other"] = sum(others) - noise
        for third, other in zip(THIRDS, others, strict=True):
            row[f"packs {third} own"], row[f"packs {third} other"] = 10.0 + noise, other - noise
        rows += [row, {"condition": "else", "seed": k}]
    return rows


@pytest.mark.parametrize(
    ("others", "verdict"),
    [
        ((10.5, 10.5, 9.7), "reproduced"),
        ((8.5, 10.5, 11.0), "partly"),
        ((13.0, 13.0, 13.0), "not"),
    ],
)
def test_the_verdict_is_of_all_thirds(others: tuple[float, float, float], verdict: str) -> None:
    """The ratio and its interval are of the whole life; p is the largest of the thirds."""
    rows = rows_of(others)
    found = measure_similar_curves(
        CLAIM, rows, "evolved", "packs {part} {body}", ("other", "own"), "packs"
    )
    assert found.verdict == verdict
    assert found.estimate == pytest.approx(sum(others) / 30.0)
    assert found.low <= found.estimate <= found.high
    assert (found.p < 0.05) == (verdict == "reproduced")
    assert found.runs == 8
