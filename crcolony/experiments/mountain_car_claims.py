"""How the claims about the mountain car are measured, from the rows of all runs."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np
from scipy import stats

from crcolony.experiments.framework.experiment import Measured, Row, pairs_of, values_of, verdict_of
from crcolony.experiments.framework.measured_pairs import measured_pairs
from crcolony.experiments.framework.registration import Claim
from crcolony.experiments.framework.statistics import (
    LEVEL,
    effect_size,
    mean_interval,
    ratio_interval,
)

BOTH = "shaping and meta-parameters"
META_ALONE = "meta-parameters alone"
TEXTBOOK = "textbook"
LAST = 10
"""Generations at the end of a run over which genes are averaged."""
_NEUTRAL_LAMBDA = 0.5
"""The mean of a neutral gene that begins even in 0 to 1, and stays in this range."""


def _times_better(column: str, claim: Claim, rows: Sequence[Row]) -> Measured:
    """Measure how often smaller a column is with evolved shaping than with the textbook's settings."""
    textbook, evolved = pairs_of(rows, column, TEXTBOOK, BOTH)
    ratio = ratio_interval(textbook, evolved)
    return measured_pairs(
        ratio,
        textbook,
        evolved,
        statistic=f"{textbook.mean():.1f} against {evolved.mean():.1f}, median of runs {np.median(evolved):.1f};"
        f" bootstrap over {evolved.size} runs",
        verdict=verdict_of(ratio.low > claim.threshold, ratio.estimate > claim.threshold),
    )


def _best_run(column: str, claim: Claim, rows: Sequence[Row]) -> Measured:
    """Measure the same of the run whose learner was best when it was chosen."""
    textbook = values_of(rows, column, TEXTBOOK)
    evolved = values_of(rows, column, BOTH)
    best = int(np.argmin(values_of(rows, "chosen_steps", BOTH)))
    ratio = mean_interval(textbook / evolved[best])
    return Measured(
        estimate=ratio.estimate,
        low=ratio.low,
        high=ratio.high,
        statistic=f"{textbook.mean():.1f} against {evolved[best]:.1f}; interval over the textbook learners alone",
        runs=evolved.size + textbook.size,
        verdict=verdict_of(ratio.estimate > claim.threshold),
    )


def _stays_robust(claim: Claim, rows: Sequence[Row]) -> Measured:
    late = values_of(rows, "late_steps", BOTH)
    mean, middle = mean_interval(late), float(np.median(late))
    textbook = values_of(rows, "late_steps", TEXTBOOK)
    return Measured(
        estimate=mean.estimate,
        low=mean.low,
        high=mean.high,
        statistic=f"median of runs {middle:.1f}; textbook {textbook.mean():.1f}; bootstrap over {late.size} runs",
        runs=late.size,
        verdict=verdict_of(mean.high <= claim.threshold, middle <= claim.threshold),
    )


def _times_better_than_alone(column: str, claim: Claim, rows: Sequence[Row]) -> Measured:
    """Measure how often smaller a column is with evolved shaping than with evolved meta-parameters alone."""
    alone, both = pairs_of(rows, column, META_ALONE, BOTH)
    ratio, gains = ratio_interval(alone, both), np.log(alone / both)
    p = _p_less(-gains, -np.log(claim.threshold))
    return measured_pairs(
        ratio,
        alone,
        both,
        statistic=f"{alone.mean():.1f} against {both.mean():.1f}; "
        f" one-sided paired t-test of logarithms, {both.size} pairs",
        p=p,
        verdict=verdict_of(
            ratio.estimate > claim.threshold and p < LEVEL, _p_less(-gains, 0.0) < LEVEL
        ),
    )


def _greedy_early(claim: Claim, rows: Sequence[Row]) -> Measured:
    founders = values_of(rows, "temperature_first", BOTH)
    early = values_of(rows, "temperature_early", BOTH)
    ratio = ratio_interval(early, founders)
    p = _p_less(early - founders, 0.0)
    return Measured(
        estimate=ratio.estimate,
        low=ratio.low,
        high=ratio.high,
        statistic=f"{early.mean():.2g} against {founders.mean():.2g}, 0 in {int((early == 0.0).sum())} runs;"
        " one-sided paired t-test",
        p=p,
        effect="A12",
        effect_size=effect_size(early, founders),
        runs=early.size,
        verdict=verdict_of(ratio.estimate <= claim.threshold and p < LEVEL, p < LEVEL),
    )


def _small_lambda(claim: Claim, rows: Sequence[Row]) -> Measured:
    evolved = values_of(rows, "lambda_end", BOTH)
    mean, p = mean_interval(evolved), _p_less(evolved, _NEUTRAL_LAMBDA)
    return Measured(
        estimate=mean.estimate,
        low=mean.low,
        high=mean.high,
        statistic=f"one-sided t-test against {_NEUTRAL_LAMBDA}, {evolved.size} runs",
        p=p,
        runs=evolved.size,
        verdict=verdict_of(mean.estimate <= claim.threshold and p < LEVEL, p < LEVEL),
    )


def _less_lambda(claim: Claim, rows: Sequence[Row]) -> Measured:
    both, alone = pairs_of(rows, "lambda_end", BOTH, META_ALONE)
    mean, p = mean_interval(both - alone), _p_less(both - alone, claim.threshold)
    return measured_pairs(
        mean,
        both,
        alone,
        statistic=f"{both.mean():.2f} against {alone.mean():.2f}; one-sided paired t-test, {both.size} pairs",
        p=p,
        verdict=verdict_of(p < LEVEL),
    )


def _p_less(values: np.ndarray, bound: float) -> float:
    """Return the p of a one-sided t-test: of the null hypothesis that the mean is the bound, or above it."""
    if values.size < 2 or np.ptp(values) == 0.0:
        return 0.0 if values.size > 1 and values[0] < bound else 1.0
    return float(stats.ttest_1samp(values, bound, alternative="less").pvalue)


MEASURES: Mapping[str, Callable[[Claim, Sequence[Row]], Measured]] = {
    "first-episode": partial(_times_better, "first_steps"),
    "robust-policy": partial(_times_better, "robust_episode"),
    "first-episode-best-run": partial(_best_run, "first_steps"),
    "robust-policy-best-run": partial(_best_run, "robust_episode"),
    "stays-robust": _stays_robust,
    "shaping-starts-better": partial(_times_better_than_alone, "first_steps"),
    "shaping-converges-sooner": partial(_times_better_than_alone, "robust_episode"),
    "greedy-early": _greedy_early,
    "small-lambda": _small_lambda,
    "shaping-needs-less-lambda": _less_lambda,
}
