"""The claims about survival are judged as they were registered, whatever the runs show."""

import numpy as np
import pytest

from crcolony.experiments.framework.catalogue import summaries
from crcolony.experiments.framework.experiment import Measured, Row
from crcolony.experiments.survival_claims import AUTONOMOUS, CENTRAL, MEASURES

CLAIMS = {claim.id: claim for claim in summaries()["survival"].claims}
RUNS = 8
NOISE = np.linspace(-0.1, 0.1, RUNS)


def measured(claim: str, autonomous: dict[str, float], central: dict[str, float]) -> Measured:
    """Return what rows show with about these numbers, a little different in each run."""
    rows: list[Row] = [
        {
            "condition": condition,
            "seed": k + 1,
            **{
                name: value + sign * (1 + place) * NOISE[k]
                for place, (name, value) in enumerate(columns.items())
            },
        }
        for condition, columns, sign in ((AUTONOMOUS, autonomous, 1), (CENTRAL, central, -1))
        for k in range(RUNS)
    ]
    return MEASURES[claim](CLAIMS[claim], rows)


@pytest.mark.parametrize(
    ("claim", "column", "more", "less"),
    [
        ("central-captures-more", "captures_end", CENTRAL, AUTONOMOUS),
        ("autonomous-mates-more", "matings_end", AUTONOMOUS, CENTRAL),
    ],
)
def test_one_selection_must_have_more_than_the_other(
    claim: str, column: str, more: str, less: str
) -> None:
    """Significantly, in pairs; a difference that is within their noise is none."""
    for high, verdict in ((6.0, "reproduced"), (3.01, "not"), (2.0, "not")):
        values = {more: {column: high}, less: {column: 3.0}}
        found = measured(claim, values[AUTONOMOUS], values[CENTRAL])
        assert found.verdict == verdict
        assert found.estimate == pytest.approx(high / 3.0)
        assert found.runs == 2 * RUNS


@pytest.mark.parametrize(
    ("claim", "before", "after"),
    [
        ("matings-rise", "matings_first", "matings_end"),
        ("captures-rise", "captures_first", "captures_end"),
        ("transfer-rises", "captures_transferred", "captures_adapted"),
    ],
)
def test_a_rise_is_one_under_autonomous_selection(claim: str, before: str, after: str) -> None:
    """Whatever happens under central selection."""
    for late, verdict in ((4.0, "reproduced"), (2.0, "not")):
        central = {before: 1.0, after: 5.0 - late}
        assert measured(claim, {before: 3.0, after: late}, central).verdict == verdict


def test_every_claim_is_measured() -> None:
    """And nothing else."""
    assert MEASURES.keys() == CLAIMS.keys()
