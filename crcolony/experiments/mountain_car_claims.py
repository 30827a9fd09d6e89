"""How the claims about the mountain car are measured, from the rows of all runs."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np

from crcolony.experiments.framework.experiment import Measured, Row, pairs_of, values_of, verdict_of
from crcolony.experiments.framework.measured_pairs import measured_pairs
from crcolony.experiments.framework.registration import Claim
from crcolony.experiments.framework.statistics import (
    LEVEL,
    mean_interval,
    one_sided_p,
    ratio_interval,
)

BOTH = "shaping and meta-parameters"
META_ALONE = "meta-parameters alone"
TEXTBOOK = "textbook"
OMPAC = "OMPAC"
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


def _times_fewer(
    worse: str, better: str, column: str, claim: Claim, rows: Sequence[Row]
) -> Measured:
    """Measure how often smaller a column is in one condition than in another, pair by pair."""
    more, fewer = pairs_of(rows, column, worse, better)
    ratio, gains = ratio_interval(more, fewer), np.log(more / fewer)
    p = one_sided_p(gains, np.log(claim.threshold), "greater")
    return measured_pairs(
        ratio,
        more,
        fewer,
        statistic=f"{more.mean():.1f} against {fewer.mean():.1f};"
        f" one-sided paired t-test of logarithms, {fewer.size} pairs",
        p=p,
        verdict=verdict_of(
            ratio.estimate > claim.threshold and p < LEVEL,
            one_sided_p(gains, 0.0, "greater") < LEVEL,
        ),
    )


def _falls(condition: str, before: str, after: str, claim: Claim, rows: Sequence[Row]) -> Measured:
    """Measure one column over another of the same runs, which is what it was before."""
    first, last = (values_of(rows, column, condition) for column in (before, after))
    ratio = ratio_interval(last, first)
    p = one_sided_p(last - first, 0.0, "less")
    return measured_pairs(
        ratio,
        last,
        first,
        statistic=f"{last.mean():.2g} against {first.mean():.2g}, 0 in {int((last == 0.0).sum())} runs;"
        " one-sided paired t-test",
        p=p,
        runs_a_pair=1,
        verdict=verdict_of(ratio.estimate <= claim.threshold and p < LEVEL, p < LEVEL),
    )


def _small_lambda(claim: Claim, rows: Sequence[Row]) -> Measured:
    evolved = values_of(rows, "lambda_end", BOTH)
    mean, p = mean_interval(evolved), one_sided_p(evolved, _NEUTRAL_LAMBDA, "less")
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
    mean, p = mean_interval(both - alone), one_sided_p(both - alone, claim.threshold, "less")
    return measured_pairs(
        mean,
        both,
        alone,
        statistic=f"{both.mean():.2f} against {alone.mean():.2f}; one-sided paired t-test, {both.size} pairs",
        p=p,
        verdict=verdict_of(p < LEVEL),
    )


MEASURES: Mapping[str, Callable[[Claim, Sequence[Row]], Measured]] = {
    "first-episode": partial(_times_better, "first_steps"),
    "robust-policy": partial(_times_better, "robust_episode"),
    "first-episode-best-run": partial(_best_run, "first_steps"),
    "robust-policy-best-run": partial(_best_run, "robust_episode"),
    "stays-robust": _stays_robust,
    "shaping-starts-better": partial(_times_fewer, META_ALONE, BOTH, "first_steps"),
    "shaping-converges-sooner": partial(_times_fewer, META_ALONE, BOTH, "robust_episode"),
    "greedy-early": partial(_falls, BOTH, "temperature_first", "temperature_early"),
    "small-lambda": _small_lambda,
    "shaping-needs-less-lambda": _less_lambda,
    "ompac-learns-better": partial(_times_fewer, TEXTBOOK, OMPAC, "late_steps"),
    "ompac-follows-learning": partial(_falls, OMPAC, "alpha_first", "alpha_end"),
    "ompac-is-for-the-old": partial(_times_fewer, OMPAC, META_ALONE, "newborn_steps"),
}
