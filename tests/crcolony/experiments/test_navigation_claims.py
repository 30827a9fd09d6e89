"""The claims about navigation are judged as registered, whatever the runs show."""

import numpy as np
import pytest

from crcolony.experiments.framework.catalogue import summaries
from crcolony.experiments.framework.experiment import Row
from crcolony.experiments.navigation_claims import (
    KHEPERA,
    KOALA,
    LARGE_WEIGHTS,
    MEASURES,
    MOVED,
    fitness_of,
)

CLAIMS = {claim.id: claim for claim in summaries()["navigation"].claims}
RUNS = 20
NOISE = np.linspace(-0.01, 0.01, RUNS)


def verdict(claim: str, rows: list[Row]) -> str:
    return MEASURES[claim](CLAIMS[claim], rows).verdict


def course(condition: str, levels: dict[int, float]) -> list[Row]:
    """Return runs whose fitness from each of these generations on is at a level."""
    rows: list[Row] = []
    for k in range(RUNS):
        for generation in range(150):
            level = levels[max(first for first in levels if first <= generation)]
            fitness = level + float(NOISE[(k + generation) % RUNS])
            own: Row = {"condition": condition, "seed": k, "generation": generation}
            rows.append({**own, "best": fitness, "mean": fitness})
    return rows


def examined(condition: str = KHEPERA, good: int = RUNS, **bad: float) -> list[Row]:
    """Return runs of which so many have a good best individual, and the others one with these numbers."""
    usual = {"fitness": 0.45, "speed": 0.8, "touched": 0.0, "laps": 1.8}
    return [
        {
            "condition": condition,
            "seed": k,
            **{name: one + float(NOISE[k]) * (name != "touched") for name, one in usual.items()},
            **(bad if k >= good else {}),
        }
        for k in range(RUNS)
    ]


def test_fitness_is_the_mean_over_generations_of_each_run() -> None:
    """Of one condition."""
    rows: list[Row] = [
        {"condition": name, "seed": seed, "generation": k, "best": seed + k + bonus}
        for name, bonus in ((KHEPERA, 0.0), (KOALA, 9.0))
        for seed in (2, 1)
        for k in range(4)
    ]
    assert fitness_of(rows, KHEPERA, "best", range(1, 3)).tolist() == [2.5, 3.5]


def test_fitness_must_double_and_then_hardly_rise() -> None:
    """A rise that goes on is no plateau."""
    assert verdict("rises", course(KHEPERA, {0: 0.1, 10: 0.4})) == "reproduced"
    assert verdict("rises", course(KHEPERA, {0: 0.3, 10: 0.4})) == "not"
    assert verdict("plateau", course(KHEPERA, {0: 0.1, 40: 0.4, 90: 0.42})) == "reproduced"
    assert verdict("plateau", course(KHEPERA, {0: 0.1, 40: 0.4, 90: 0.8})) == "not"


def test_another_body_must_cost_fitness_that_comes_back_in_time() -> None:
    """Not one in which nothing is lost, nor one in which it stays so."""
    back = course(KOALA, {0: 0.4, MOVED: 0.2, MOVED + 20: 0.4})
    lost = course(KOALA, {0: 0.4, MOVED: 0.2})
    same = course(KOALA, {0: 0.4})
    assert [verdict("drop", rows) for rows in (back, lost, same)] == ["reproduced"] * 2 + ["not"]
    assert [verdict("readapts", rows) for rows in (back, lost)] == ["reproduced", "not"]


@pytest.mark.parametrize(("touched", "laps"), [(0.2, 1.8), (0.0, 0.5)])
def test_smooth_is_to_drive_laps_without_contact(touched: float, laps: float) -> None:
    """Nearly all runs must; most of them are a part of it."""
    found = [
        verdict("smooth", examined(good=good, touched=touched, laps=laps)) for good in (19, 16, 10)
    ]
    assert found == ["reproduced", "partly", "not"]


def test_direction_and_speed_are_those_of_the_best() -> None:
    """Who drives backwards does not drive ahead, but may be as fast."""
    found = [verdict("more-sensors-ahead", examined(good=k, speed=-0.8)) for k in (19, 16, 10)]
    assert found == ["reproduced", "partly", "not"]
    assert verdict("below-full-speed", examined(good=10, speed=-0.8)) == "reproduced"
    fast = [{**row, "speed": 0.16 + float(row["speed"])} for row in examined()]
    assert verdict("below-full-speed", fast) == "not"


@pytest.mark.parametrize(
    ("laps", "fitness", "expected"),
    [(0.1, 0.8, "reproduced"), (0.1, 0.3, "partly"), (1.8, 0.8, "not")],
)
def test_who_rocks_on_the_spot_is_fitter_with_fewer_laps(
    laps: float, fitness: float, expected: str
) -> None:
    """Fewer laps without more fitness are no way to have it without navigation."""
    rocking = examined(LARGE_WEIGHTS, 0, laps=laps, fitness=fitness)
    rocking = [
        {**row, "laps": float(row["laps"]) + 0.01 * (k % 2)} for k, row in enumerate(rocking)
    ]
    assert verdict("rocks-on-the-spot", rocking + examined()) == expected
