"""The claims about mating strategies are judged as they were registered, whatever the runs show."""

import numpy as np
import pytest

from crcolony.experiments.framework.catalogue import summaries
from crcolony.experiments.framework.experiment import Measured, Row
from crcolony.experiments.mating_strategies_claims import (
    DENSITIES,
    MEASURES,
    SHARES,
    condition_of,
    crossing_of,
    differences_of,
)

CLAIMS = {claim.id: claim for claim in summaries()["mating-strategies"].claims}
SEEDS = range(1, 11)


def measured(claim: str, rows: list[Row]) -> Measured:
    return MEASURES[claim](CLAIMS[claim], rows)


def populations(foragers: dict[float, list[float]]) -> list[Row]:
    """Return the last populations of runs with these shares of foragers, by density; the others track."""
    return [
        {
            "condition": condition_of(density),
            "seed": seed,
            "packs_per_robot": density,
            "foragers": share,
            "trackers": 1.0 - share,
        }
        for density, shares in foragers.items()
        for seed, share in enumerate(shares, 1)
    ]


def mixtures(crossing: float, slope: float) -> list[Row]:
    """Return mixtures in which foragers do better than trackers by a line that crosses 0, and a little noise."""
    rows: list[Row] = []
    for density in DENSITIES:
        for seed in SEEDS:
            for share in SHARES:
                row: Row = {"condition": condition_of(density), "seed": seed, "share": share}
                noise = 0.02 * np.sin(seed + 10.0 * share)
                if share > 0.0:
                    row["forager_fitness"] = 3.0 + slope * (share - crossing) + noise
                if share < 1.0:
                    row["tracker_fitness"] = 3.0
                rows.append(row)
    return rows


@pytest.mark.parametrize(
    ("mixed", "expected"), [(6, "reproduced"), (2, "partly"), (0, "not"), (10, "reproduced")]
)
def test_coexistence_takes_half_of_the_populations(mixed: int, expected: str) -> None:
    """More than by chance, but fewer, is reproduced in part."""
    shares = [0.3] * mixed + [0.02] * (10 - mixed)
    found = measured("coexistence", populations(dict.fromkeys(DENSITIES, shares)))
    assert found.verdict == expected
    assert found.estimate == pytest.approx(mixed / 10)


def test_density_decides_if_the_share_of_foragers_changes_with_it() -> None:
    """In either direction; the same everywhere it does not."""
    noise = np.linspace(0.0, 0.05, 10)
    rising = {density: list(0.1 * k + noise) for k, density in enumerate(DENSITIES)}
    falling = {density: list(0.4 - 0.1 * k + noise) for k, density in enumerate(DENSITIES)}
    assert measured("density", populations(rising)).verdict == "reproduced"
    assert measured("density", populations(falling)).verdict == "reproduced"
    alike = {density: list(0.3 + noise) for density in DENSITIES}
    assert measured("density", populations(alike)).verdict == "not"


def test_a_mixture_is_stable_if_the_rare_do_better() -> None:
    """If the many do better it is not."""
    assert measured("rare-is-better", mixtures(0.25, -2.0)).verdict == "reproduced"
    assert measured("rare-is-better", mixtures(0.25, 2.0)).verdict == "not"


@pytest.mark.parametrize(
    ("crossing", "slope", "expected"),
    [
        (0.25, -2.0, "reproduced"),
        (0.6, -2.0, "partly"),
        (-0.5, -2.0, "not"),
        (1.5, -2.0, "not"),
        (0.25, 2.0, "not"),
    ],
)
def test_the_crossing_is_near_a_quarter(crossing: float, slope: float, expected: str) -> None:
    """Another one between 0 and 1 is reproduced in part, one of rising lines is none."""
    assert measured("crossing", mixtures(crossing, slope)).verdict == expected


def test_differences_are_of_mixtures_that_have_both() -> None:
    """Foragers alone and trackers alone are compared with nobody."""
    shares, differences = differences_of(mixtures(0.25, -2.0), DENSITIES[0])
    assert shares.tolist() == [share for share in SHARES if 0.0 < share < 1.0]
    assert differences.shape == (10, shares.size)
    assert crossing_of(shares, differences.mean(axis=0)) == pytest.approx(0.25, abs=0.02)
