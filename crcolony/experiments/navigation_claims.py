"""How the claims about navigation are measured, from the rows of all runs."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Literal

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.experiments.framework.experiment import (
    CONDITION,
    SEED,
    Measured,
    Row,
    pairs_of,
    values_of,
    verdict_of,
)
from crcolony.experiments.framework.measured_pairs import measured_pairs, measured_ratio
from crcolony.experiments.framework.measured_share import measured_share
from crcolony.experiments.framework.registration import Claim
from crcolony.experiments.framework.statistics import (
    LEVEL,
    mean_interval,
    one_sided_p,
    ratio_interval,
)

KHEPERA, KOALA, LARGE_WEIGHTS = "khepera", "koala", "khepera-large-weights"
MOVED = 106
"""The first generation in the Koala"""
_FIRST, _FIFTY, _HUNDRED = range(1), range(45, 55), range(95, 105)
_BEFORE, _AFTER, _READAPTED = range(MOVED - 5, MOVED), range(MOVED, MOVED + 1), range(131, 141)
"""Generations over which fitness is averaged"""
_TOUCHES = 0.01
"""Share of sensorimotor loops that still is no collision"""


def fitness_of(rows: Sequence[Row], condition: str, column: str, when: range) -> FloatArray:
    """Return a kind of fitness of each run (runs,), the mean over generations, in the order of seeds."""
    by_seed: dict[int, list[float]] = {}
    for row in rows:
        if row[CONDITION] == condition and row.get("generation") in when:
            by_seed.setdefault(int(row[SEED]), []).append(float(row[column]))
    return np.array([np.mean(by_seed[seed]) for seed in sorted(by_seed)])


def _changes(
    condition: str,
    column: str,
    when: tuple[range, range],
    alternative: Literal["greater", "less"],
    claim: Claim,
    rows: Sequence[Row],
) -> Measured:
    """Measure the ratio of fitness at two times; it is above, or below, the threshold."""
    one, other = (fitness_of(rows, condition, column, generations) for generations in when)
    return measured_ratio(
        claim,
        one,
        other,
        statistic=f"{one.mean():.3f} against {other.mean():.3f}; one-sided paired t-test, {one.size} runs",
        alternative=alternative,
    )


def _reaches(
    condition: str, column: str, when: tuple[range, range], claim: Claim, rows: Sequence[Row]
) -> Measured:
    """Measure the ratio of fitness at two times; it is as large as the threshold."""
    one, other = (fitness_of(rows, condition, column, generations) for generations in when)
    ratio = ratio_interval(one, other)
    return measured_pairs(
        ratio,
        one,
        other,
        statistic=f"{one.mean():.3f} against {other.mean():.3f}; bootstrap over {one.size} runs",
        verdict=verdict_of(ratio.estimate >= claim.threshold, ratio.high >= claim.threshold),
    )


def _smooth(claim: Claim, rows: Sequence[Row]) -> Measured:
    touched, laps = (values_of(rows, name, KHEPERA) for name in ("touched", "laps"))
    return measured_share(claim, (touched <= _TOUCHES) & (laps >= 1.0))


def _ahead(claim: Claim, rows: Sequence[Row]) -> Measured:
    return measured_share(claim, values_of(rows, "speed", KHEPERA) > 0.0)


def _below_full_speed(claim: Claim, rows: Sequence[Row]) -> Measured:
    speeds = np.abs(values_of(rows, "speed", KHEPERA))
    mean = mean_interval(speeds)
    p = one_sided_p(speeds, claim.threshold, "less")
    return Measured(
        estimate=mean.estimate,
        low=mean.low,
        high=mean.high,
        statistic=f"{80.0 * mean.estimate:.0f} mm/s; one-sided t-test, {speeds.size} runs",
        p=p,
        runs=speeds.size,
        verdict=verdict_of(mean.estimate < claim.threshold and p < LEVEL),
    )


def _rocks(claim: Claim, rows: Sequence[Row]) -> Measured:
    laps, usual_laps = pairs_of(rows, "laps", LARGE_WEIGHTS, KHEPERA)
    fitness, usual = pairs_of(rows, "fitness", LARGE_WEIGHTS, KHEPERA)
    ratio = ratio_interval(laps, usual_laps)
    fewer = one_sided_p(laps - usual_laps, 0.0, "less")
    fitter = one_sided_p(fitness - usual, 0.0, "greater")
    has_fewer = ratio.estimate < claim.threshold and fewer < LEVEL
    return measured_pairs(
        ratio,
        laps,
        usual_laps,
        statistic=f"{laps.mean():.2f} against {usual_laps.mean():.2f} laps, fitness {fitness.mean():.2f} against"
        f" {usual.mean():.2f}; one-sided paired t-tests, {laps.size} pairs",
        p=max(fewer, fitter),
        verdict=verdict_of(has_fewer and fitter < LEVEL, has_fewer),
    )


MEASURES: Mapping[str, Callable[[Claim, Sequence[Row]], Measured]] = {
    "rises": partial(_changes, KHEPERA, "best", (_FIFTY, _FIRST), "greater"),
    "plateau": partial(_reaches, KHEPERA, "best", (_FIFTY, _HUNDRED)),
    "smooth": _smooth,
    "more-sensors-ahead": _ahead,
    "below-full-speed": _below_full_speed,
    "drop": partial(_changes, KOALA, "mean", (_AFTER, _BEFORE), "less"),
    "readapts": partial(_reaches, KOALA, "mean", (_READAPTED, _BEFORE)),
    "rocks-on-the-spot": _rocks,
}
