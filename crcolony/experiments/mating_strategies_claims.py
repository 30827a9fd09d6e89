"""How the claims about mating strategies are measured, from the rows of all runs."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from scipy import stats

from crcolony.compiled import FloatArray
from crcolony.experiments.framework.experiment import CONDITION, SEED, Measured, Row, verdict_of
from crcolony.experiments.framework.registration import Claim
from crcolony.experiments.framework.statistics import (
    LEVEL,
    mean_interval,
    one_sided_p,
    rank_correlation,
)

DENSITIES = (1.0, 1.5, 2.0, 4.0)
"""Batteries for each robot; 2 in the default world"""
DEFAULT_DENSITY = 2.0
SHARES = (0.0, 0.1, 0.25, 0.5, 0.75, 1.0)
"""Of foragers, in mixtures"""
_ENOUGH = 0.1
"""Share of a population from which on a strategy is part of it"""
_NEAR = 0.15
_RARE = 0.05
_REPORTED = 4.0 / 7.0
"""Share of populations in which both coexist (Elfwing and Doya 2014)"""
_RESAMPLES = 2_000


def condition_of(density: float) -> str:
    """Return the name of the condition with so many batteries for each robot."""
    return f"{density:g} batteries"


def curve_of(rows: Sequence[Row], density: float, column: str) -> tuple[FloatArray, FloatArray]:
    """Return the shares of foragers in which a fitness was measured, and its values (seeds, shares)."""
    own = [row for row in rows if row[CONDITION] == condition_of(density) and column in row]
    shares = sorted({float(row["share"]) for row in own})
    seeds = sorted({row[SEED] for row in own}, key=float)
    values = {(row[SEED], row["share"]): float(row[column]) for row in own}
    found = [[values[seed, share] for share in shares] for seed in seeds]
    return np.array(shares), np.array(found).reshape(len(seeds), len(shares))


def differences_of(rows: Sequence[Row], density: float) -> tuple[FloatArray, FloatArray]:
    """Return the shares with both strategies, and by how much foragers do better (seeds, shares)."""
    foraging, foragers = curve_of(rows, density, "forager_fitness")
    tracking, trackers = curve_of(rows, density, "tracker_fitness")
    both = np.intersect1d(foraging, tracking)
    return both, foragers[:, np.isin(foraging, both)] - trackers[:, np.isin(tracking, both)]


def crossing_of(shares: FloatArray, differences: FloatArray) -> float:
    """Return the share at which a falling line through differences (shares,) is 0; NaN if it does not fall."""
    slope, start = np.polyfit(shares, differences, 1)
    return float(-start / slope) if slope < 0.0 else np.nan


def _coexistence(claim: Claim, rows: Sequence[Row]) -> Measured:
    populations = [row for row in rows if "foragers" in row]
    both = sum(
        float(row["foragers"]) >= _ENOUGH and float(row["trackers"]) >= _ENOUGH
        for row in populations
    )
    found = stats.binomtest(both, len(populations), _RARE, alternative="greater")
    interval = stats.binomtest(both, len(populations)).proportion_ci()
    share = both / len(populations)
    is_met = share >= claim.threshold and float(interval.high) >= _REPORTED
    return Measured(
        estimate=share,
        low=float(interval.low),
        high=float(interval.high),
        statistic=f"{both} of {len(populations)} populations; exact binomial test against {_RARE:.0%}",
        p=float(found.pvalue),
        runs=len(populations),
        verdict=verdict_of(is_met, bool(found.pvalue < LEVEL)),
    )


def _density(claim: Claim, rows: Sequence[Row]) -> Measured:
    populations = [row for row in rows if "foragers" in row]
    density, foragers = (
        np.array([float(row[name]) for row in populations])
        for name in ("packs_per_robot", "foragers")
    )
    found = rank_correlation(density, foragers)
    is_sure = bool(found.p < LEVEL)
    return Measured(
        estimate=found.rho,
        low=found.low,
        high=found.high,
        statistic="Spearman",
        p=found.p,
        effect="ρ",
        effect_size=found.rho,
        runs=len(populations),
        verdict=verdict_of(is_sure and abs(found.rho) >= claim.threshold, is_sure),
    )


def _rare_is_better(claim: Claim, rows: Sequence[Row]) -> Measured:
    slopes = np.mean(
        [
            np.polyfit(shares, differences.T, 1)[0]
            for shares, differences in (differences_of(rows, one) for one in DENSITIES)
        ],
        axis=0,
    )
    mean = mean_interval(slopes)
    p = one_sided_p(slopes, claim.threshold, "less")
    return Measured(
        estimate=mean.estimate,
        low=mean.low,
        high=mean.high,
        statistic=f"one-sided t-test, {slopes.size} seeds",
        p=p,
        effect="d",
        effect_size=float(mean.estimate / slopes.std(ddof=1)),
        runs=slopes.size * len(DENSITIES),
        verdict=verdict_of(p < LEVEL),
    )


def _crossing(claim: Claim, rows: Sequence[Row]) -> Measured:
    shares, differences = differences_of(rows, DEFAULT_DENSITY)
    crossing = crossing_of(shares, differences.mean(axis=0))
    runs = len(differences)
    drawn = np.random.default_rng(0).integers(runs, size=(_RESAMPLES, runs))
    found = np.array([crossing_of(shares, differences[one].mean(axis=0)) for one in drawn])
    falling = found[~np.isnan(found)]
    if falling.size == 0:
        falling = np.array([np.nan])
    low, high = np.quantile(falling, (LEVEL / 2.0, 1.0 - LEVEL / 2.0))
    is_there = 0.0 < crossing < 1.0
    is_near = bool(abs(crossing - claim.threshold) <= _NEAR and low <= claim.threshold <= high)
    return Measured(
        estimate=crossing,
        low=float(low),
        high=float(high),
        statistic=f"bootstrap over seeds; the line falls in {np.mean(~np.isnan(found)):.0%} of {_RESAMPLES} samples",
        runs=runs,
        verdict=verdict_of(is_there and is_near, is_there),
    )


MEASURES: Mapping[str, Callable[[Claim, Sequence[Row]], Measured]] = {
    "coexistence": _coexistence,
    "density": _density,
    "rare-is-better": _rare_is_better,
    "crossing": _crossing,
}
