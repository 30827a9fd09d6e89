"""The claims about stability are judged as registered, whatever the runs show."""

import math
from collections.abc import Mapping

import numpy as np
import pytest

from crcolony.experiments.framework.catalogue import summaries
from crcolony.experiments.framework.experiment import Plan, Row
from crcolony.experiments.stability import (
    AGES,
    COLUMNS,
    ENERGIES,
    EXPERIMENT,
    REGIMES,
    _slope,
    draw,
    run,
)

CLAIMS = {claim.id: claim for claim in summaries()["stability"].claims}
RUNS = 20


def rows_with(regime: str, completed: int, extinct: int = 0, slope: float = 0.0) -> list[Row]:
    """Return rows of a regime of which so many complete or die out, and the others explode."""
    ends = ["completed"] * completed + ["extinct"] * extinct
    ends += ["exploded"] * (RUNS - len(ends))
    rows: list[Row] = []
    for k, end in enumerate(ends):
        row: Row = {"condition": regime, "seed": k, **dict.fromkeys(COLUMNS, 0.0)}
        row[end], row["matings_slope"] = 1, slope + 0.001 * (k % 3 - 1)
        rows.append(row)
    return rows


def verdict(claim: str, rows: list[Row]) -> str:
    return EXPERIMENT.measures[claim](CLAIMS[claim], rows).verdict


@pytest.mark.parametrize("regime", ["fitness", "density", "colony"])
@pytest.mark.parametrize(
    ("completed", "expected"), [(20, "reproduced"), (16, "partly"), (10, "not")]
)
def test_a_regime_is_stable_if_nearly_all_runs_complete(
    regime: str, completed: int, expected: str
) -> None:
    """More than half, significantly, is a part of it."""
    claim = "fitness-stable" if regime == "fitness" else f"{regime}-completes"
    assert verdict(claim, rows_with(regime, completed)) == expected


def sweep(regimes: tuple[str, ...], completed: Mapping[int, int], flips: bool = True) -> list[Row]:
    """Return rows of a sweep: its first half dies out, or explodes as well if it does not flip."""
    rows: list[Row] = []
    for k, regime in enumerate(regimes):
        done = completed.get(k, 0)
        dies_out = flips and k < len(regimes) // 2
        rows += rows_with(regime, done, RUNS - done if dies_out else 0)
    return rows


def test_no_number_of_a_sweep_may_hold_a_population() -> None:
    """One that holds most of its runs is enough against the claim; half of them is not clear."""
    for claim, regimes in (("age-unstable", AGES), ("energy-flips", ENERGIES)):
        assert verdict(claim, sweep(regimes, {1: 2})) == "reproduced"
        assert verdict(claim, sweep(regimes, {1: 9})) == "partly"
        assert verdict(claim, sweep(regimes, {2: 15})) == "not"


def test_energy_flips_only_between_two_ends() -> None:
    """A regime that explodes always does not; age need not flip."""
    assert verdict("energy-flips", sweep(ENERGIES, {}, flips=False)) == "partly"
    assert verdict("age-unstable", sweep(AGES, {}, flips=False)) == "reproduced"


@pytest.mark.parametrize(("slope", "is_rising"), [(0.02, True), (-0.02, False)])
def test_slopes_are_to_differ_from_none(slope: float, is_rising: bool) -> None:
    """Downwards for death by density, upwards for the colony."""
    expected = ("reproduced", "not")
    rising, falling = expected if is_rising else expected[::-1]
    assert verdict("colony-improves", rows_with("colony", RUNS, slope=slope)) == rising
    assert verdict("density-declines", rows_with("density", RUNS, slope=slope)) == falling
    assert verdict("colony-improves", rows_with("colony", RUNS)) == "not"


@pytest.mark.parametrize("regime", REGIMES)
def test_a_run_gives_what_the_columns_say(regime: str) -> None:
    """It ends in one way; each condition is a regime."""
    row = run(regime, 1, 3)
    assert set(row) == set(COLUMNS)
    assert sum(int(row[end]) for end in ("completed", "extinct", "exploded")) == 1
    assert {job.condition for job in EXPERIMENT.jobs(Plan([1]))} == set(REGIMES)


def test_a_slope_is_that_of_a_line() -> None:
    """Of two values there is none."""
    assert np.isclose(_slope([1.0, 3.0, 5.0]), 2.0)
    assert math.isnan(_slope([1.0, 3.0]))


def test_the_figure_has_every_regime() -> None:
    """Its bars add up to all runs."""
    figure = draw([row for regime in REGIMES for row in rows_with(regime, 12, 5)])
    ends, slopes = figure.axes
    heights = np.array([[bar.get_height() for bar in bars] for bars in ends.containers])
    assert heights.shape == (3, len(REGIMES))
    assert np.allclose(heights.sum(axis=0), 1.0)
    points = [np.asarray(line.get_xdata()).size for line in slopes.lines]
    assert points.count(RUNS) == 3
