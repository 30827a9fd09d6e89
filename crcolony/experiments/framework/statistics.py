"""The statistics of a comparison: intervals, effect sizes, equivalence and correlations over runs.

Runs of two conditions with the same seed begin with the same founders in the same arena, and are compared in pairs.
Resampling starts from a fixed seed, so that a report is the same whenever it is made.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy import stats

from crcolony.compiled import FloatArray, IntArray

MIN_RUNS = 3
"""With fewer runs there are no intervals and no tests: they are NaN."""
LEVEL = 0.05
"""The level of significance of all tests; intervals cover 1 - LEVEL."""
_RESAMPLES = 10_000
_ROUNDING = 1e-9
"""Values that differ by less than this share of them are all alike."""
_SMALLEST = 1e-12
"""A denominator that is smaller, as of a colony that never mates, counts as this."""
_FIELLER = 1.06
"""The variance of Fisher's z of a Spearman correlation is this over n - 3 (Fieller, Hartley & Pearson 1957)."""


@dataclass(frozen=True)
class Interval:
    """An estimate with its 95 % interval by bootstrap (percentiles)."""

    estimate: float
    low: float
    high: float


@dataclass(frozen=True)
class Equivalence:
    """Two one-sided t-tests of paired differences against a margin on either side (Schuirmann 1987)."""

    difference: float
    low: float
    high: float
    """The 90 % interval of the mean difference: within the margins exactly if `p` is below 0.05"""
    p_inferior: float
    """Of the null hypothesis that the mean difference is the margin, or more, below 0"""
    p_superior: float
    """Of the null hypothesis that it is the margin, or more, above 0"""

    @property
    def p(self) -> float:
        """Of the null hypothesis that the two are not equivalent."""
        return max(self.p_inferior, self.p_superior)


@dataclass(frozen=True)
class Correlation:
    """A rank correlation (Spearman) with its p, and its 95 % interval by Fisher's z."""

    rho: float
    p: float
    low: float
    high: float


def mean_interval(values: FloatArray) -> Interval:
    """Return the mean of values (runs,) with its interval; values that are NaN are left out."""
    values = values[~np.isnan(values)]
    if values.size < MIN_RUNS:
        return Interval(float(values.mean()) if values.size else np.nan, np.nan, np.nan)
    found = stats.bootstrap(
        (values,),
        np.mean,
        n_resamples=_RESAMPLES,
        confidence_level=1.0 - LEVEL,
        method="percentile",
        rng=np.random.default_rng(0),
    ).confidence_interval
    return Interval(float(values.mean()), float(found.low), float(found.high))


def ratio_interval(numerators: FloatArray, denominators: FloatArray) -> Interval:
    """Return the ratio of the means of paired values (runs,) with its interval."""
    estimate = float(_ratio(numerators, denominators))
    if numerators.size < MIN_RUNS:
        return Interval(estimate, np.nan, np.nan)
    found = stats.bootstrap(
        (numerators, denominators),
        _ratio,
        paired=True,
        n_resamples=_RESAMPLES,
        confidence_level=1.0 - LEVEL,
        method="percentile",
        rng=np.random.default_rng(0),
    ).confidence_interval
    return Interval(estimate, float(found.low), float(found.high))


def _ratio(numerators: FloatArray, denominators: FloatArray, axis: int = -1) -> FloatArray:
    ratio: FloatArray = numerators.mean(axis) / np.maximum(denominators.mean(axis), _SMALLEST)
    return ratio


def effect_size(one: FloatArray, other: FloatArray) -> float:
    """Return A12, the probability that a run of the one is above a run of the other (Vargha & Delaney 2000)."""
    wins = stats.mannwhitneyu(one, other).statistic
    return float(wins) / (one.size * other.size)


def one_sided_p(values: FloatArray, bound: float, alternative: Literal["less", "greater"]) -> float:
    """Return the p of a t-test: of the null hypothesis that the mean of values (runs,) is the bound, or on its wrong
    side.

    Pairs are tested by their differences. Values that are all alike leave no doubt: p is 0 or 1.
    """
    if values.size < MIN_RUNS:
        return np.nan
    if np.ptp(values) <= _ROUNDING * np.abs(values).max():
        is_beyond = values[0] > bound if alternative == "greater" else values[0] < bound
        return 0.0 if is_beyond else 1.0
    return float(stats.ttest_1samp(values, bound, alternative=alternative).pvalue)


def equivalence(one: FloatArray, other: FloatArray, margin: float) -> Equivalence:
    """Test paired values (runs,) for equivalence within `margin`, which is above 0 and in their unit."""
    differences = one - other
    if differences.size < MIN_RUNS:
        return Equivalence(float(differences.mean()), np.nan, np.nan, np.nan, np.nan)
    inferior = stats.ttest_1samp(differences, -margin, alternative="greater")
    superior = stats.ttest_1samp(differences, margin, alternative="less")
    interval = stats.ttest_1samp(differences, 0.0).confidence_interval(1.0 - 2.0 * LEVEL)
    return Equivalence(
        float(differences.mean()),
        float(interval.low),
        float(interval.high),
        float(inferior.pvalue),
        float(superior.pvalue),
    )


def holm(p_values: Sequence[float]) -> list[float]:
    """Return p values corrected for their number (Holm 1979); those that are NaN are not counted, and stay."""
    order = sorted((p, index) for index, p in enumerate(p_values) if not np.isnan(p))
    corrected = list(p_values)
    highest = 0.0
    for rank, (p, index) in enumerate(order):
        highest = max(highest, min(1.0, p * (len(order) - rank)))
        corrected[index] = highest
    return corrected


def rank_correlation(one: FloatArray, other: FloatArray) -> Correlation:
    """Return the rank correlation of two quantities (runs,); NaN where one does not vary."""
    if one.size <= MIN_RUNS or np.ptp(one) == 0.0 or np.ptp(other) == 0.0:
        return Correlation(np.nan, np.nan, np.nan, np.nan)
    found = stats.spearmanr(one, other)
    rho = float(found.statistic)
    half = stats.norm.ppf(1.0 - LEVEL / 2.0) * np.sqrt(_FIELLER / (one.size - 3))
    z = np.arctanh(np.clip(rho, -1.0 + 1e-12, 1.0 - 1e-12))
    return Correlation(rho, float(found.pvalue), float(np.tanh(z - half)), float(np.tanh(z + half)))


def mean_pairwise_correlation(profiles: FloatArray) -> Interval:
    """Return the mean correlation (Pearson) of every two runs' profiles (runs, points), with its interval over runs.

    A run that is drawn twice is no pair with itself.
    """
    correlations = np.atleast_2d(np.corrcoef(profiles))

    def mean_of(runs: IntArray) -> float:
        drawn = correlations[np.ix_(runs, runs)]
        pairs = drawn[runs[:, None] != runs[None, :]]
        return float(pairs.mean()) if pairs.size else np.nan

    everyone = np.arange(len(profiles))
    if everyone.size < MIN_RUNS:
        return Interval(mean_of(everyone), np.nan, np.nan)
    draws = np.random.default_rng(0).integers(everyone.size, size=(_RESAMPLES, everyone.size))
    means = np.array([mean_of(draw) for draw in draws])
    low, high = np.nanquantile(means, (LEVEL / 2.0, 1.0 - LEVEL / 2.0))
    return Interval(mean_of(everyone), float(low), float(high))


def correlation_power(rho: float, runs: int) -> float:
    """Return the probability that a rank correlation of this size is significant over so many runs (Fisher's z)."""
    shift = np.arctanh(abs(rho)) / np.sqrt(_FIELLER / (runs - 3))
    critical = stats.norm.ppf(1.0 - LEVEL / 2.0)
    return float(stats.norm.sf(critical - shift) + stats.norm.cdf(-critical - shift))


def detectable_correlation(runs: int, power: float) -> float:
    """Return the smallest rank correlation that so many runs show with this power (Fisher's z)."""
    quantiles = stats.norm.ppf(1.0 - LEVEL / 2.0) + stats.norm.ppf(power)
    return float(np.tanh(quantiles * np.sqrt(_FIELLER / (runs - 3))))
