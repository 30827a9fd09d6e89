"""The claims of Paper III are judged as they were registered, whatever the runs show."""

from typing import Any

import numpy as np
import pytest

from crcolony.experiments.framework.catalogue import summaries
from crcolony.experiments.framework.experiment import Row
from crcolony.experiments.framework.similar_curves import THIRDS
from crcolony.experiments.learning_ability import COLUMNS
from crcolony.experiments.learning_ability_claims import MEASURES, POTENTIALS

CLAIMS = {claim.id: claim for claim in summaries()["learning-ability"].claims}
RUNS = 12


def rows_with(condition: str, **columns: Any) -> list[Row]:
    """Return rows of a condition: a column is one number, or one for each run; potentials are noise."""
    rng = np.random.default_rng(len(condition))
    rows: list[Row] = []
    for k in range(RUNS):
        row: Row = {"condition": condition, "seed": k + 1}
        for name in COLUMNS:
            row[name] = float(rng.normal())
        row.update({name: float(np.broadcast_to(v, RUNS)[k]) for name, v in columns.items()})
        rows.append(row)
    return rows


def verdict(claim: str, own: dict[str, Any], central: dict[str, Any] | None = None) -> str:
    rows = rows_with("implicit", **own) + rows_with("central", **(central or {}))
    return MEASURES[claim](CLAIMS[claim], rows).verdict


NOISE = np.linspace(-0.1, 0.1, RUNS)


@pytest.mark.parametrize(("own", "expected"), [(6.0, "reproduced"), (5.5, "partly"), (3.0, "not")])
def test_parity_is_to_be_not_worse_by_a_tenth(own: float, expected: str) -> None:
    """Nearer to the margin than the runs can tell it is reproduced in part."""
    name = "energy_weighted_matings_end"
    assert verdict("parity", {name: own + 10 * NOISE}, {name: 6.0}) == expected


def test_a_better_start_is_significant() -> None:
    """More matings early; as many are no better start."""
    other = {"matings_early": 1.0 + NOISE}
    assert verdict("better-start", {"matings_early": 1.2 + NOISE[::-1]}, other) == "reproduced"
    assert verdict("better-start", {"matings_early": 1.0 + NOISE[::-1]}, other) == "not"


@pytest.mark.parametrize("module", ["mating", "foraging"])
@pytest.mark.parametrize(("tau", "expected"), [(0.05, "reproduced"), (0.3, "partly"), (0.5, "not")])
def test_tau_goes_to_zero_further_than_a_neutral_gene(
    module: str, tau: float, expected: str
) -> None:
    """Lower than that, but not near 0, it is reproduced in part."""
    own = {f"{module}_tau_end": tau + NOISE / 10, f"{module}_tau_neutral": 0.5 - NOISE / 5}
    assert verdict(f"tau-{module}", own) == expected


def test_the_correlation_of_matings_and_lambda_must_be_negative() -> None:
    """And significant."""
    for slope, expected in ((-1.0, "reproduced"), (1.0, "not")):
        own = {"matings_end": NOISE, "mating_lambda_end": slope * NOISE}
        assert verdict("lambda-matings", own) == expected
    alternating = {"matings_end": NOISE, "mating_lambda_end": np.tile([0.1, 0.2], RUNS // 2)}
    assert verdict("lambda-matings", alternating) == "not"


def test_potentials_differ_if_they_have_little_in_common() -> None:
    """Those of noise do; those of all runs alike do not."""
    assert verdict("potentials-differ", {}) == "reproduced"
    alike = {name: k + NOISE / 10 for k, name in enumerate(POTENTIALS)}
    assert verdict("potentials-differ", alike) == "not"


@pytest.mark.parametrize(
    ("claim", "what", "body"),
    [
        ("mating-transfers", "matings", "worn"),
        ("foraging-transfers", "captures", "worn"),
        ("mating-transfers-delayed", "matings", "delayed"),
        ("foraging-transfers-delayed", "captures", "delayed"),
    ],
)
def test_learning_in_another_body_must_be_similar_in_each_third_of_a_life(
    claim: str, what: str, body: str
) -> None:
    """A worse start and a better end are similar in part; better all along is not similar."""
    for others, expected in (
        ((5.2, 5.2, 4.9), "reproduced"),
        ((4.0, 5.2, 5.6), "partly"),
        ((6.0, 6.0, 6.0), "not"),
    ):
        own: dict[str, Any] = {
            f"transfer_{what}_life_own": 15.0 + NOISE,
            f"transfer_{what}_life_{body}": sum(others) - NOISE,
        }
        for third, other in zip(THIRDS, others, strict=True):
            own[f"transfer_{what}_{third}_own"] = 5.0 + NOISE
            own[f"transfer_{what}_{third}_{body}"] = other - NOISE
        assert verdict(claim, own) == expected
