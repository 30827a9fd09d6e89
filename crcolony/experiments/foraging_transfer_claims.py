"""How the claims about foraging and its transfer are measured, from the rows of all runs."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from crcolony.experiments.framework.experiment import Measured, Row, pairs_of, values_of, verdict_of
from crcolony.experiments.framework.measured_pairs import measured_pairs, measured_ratio
from crcolony.experiments.framework.registration import Claim
from crcolony.experiments.framework.similar_curves import measure_similar_curves
from crcolony.experiments.framework.statistics import (
    LEVEL,
    mean_interval,
    one_sided_p,
    ratio_interval,
)

BOTH = "shaping and meta-parameters"
META_ALONE = "meta-parameters alone"
LAST = 10
"""Generations at the end of a run over which genes are averaged."""
_NEUTRAL = 0.5
"""The mean of a neutral gene that begins even in 0 to 1, and stays in this range."""


def _similar_curves(body: str, claim: Claim, rows: Sequence[Row]) -> Measured:
    return measure_similar_curves(claim, rows, BOTH, "{part}_{body}", (body, "own"), "packs")


def _captures_more(column: str, claim: Claim, rows: Sequence[Row]) -> Measured:
    both, alone = pairs_of(rows, column, BOTH, META_ALONE)
    return measured_ratio(
        claim,
        both,
        alone,
        statistic=f"{both.mean():.1f} against {alone.mean():.1f} packs; one-sided paired t-test, {both.size} pairs",
    )


def _small_lambda(claim: Claim, rows: Sequence[Row]) -> Measured:
    evolved = values_of(rows, "lambda_end", BOTH)
    alone = values_of(rows, "lambda_end", META_ALONE)
    mean = mean_interval(evolved)
    p = one_sided_p(evolved, _NEUTRAL, "less")
    return Measured(
        estimate=mean.estimate,
        low=mean.low,
        high=mean.high,
        statistic=f"{alone.mean():.2f} where meta-parameters evolve alone; one-sided t-test"
        f" against {_NEUTRAL}, {evolved.size} runs",
        p=p,
        runs=evolved.size,
        verdict=verdict_of(mean.estimate <= claim.threshold and p < LEVEL, p < LEVEL),
    )


def _greedy(claim: Claim, rows: Sequence[Row]) -> Measured:
    founders = values_of(rows, "temperature_first", BOTH)
    evolved = values_of(rows, "temperature_end", BOTH)
    ratio = ratio_interval(evolved, founders)
    p = one_sided_p(evolved - founders, 0.0, "less")
    return measured_pairs(
        ratio,
        evolved,
        founders,
        statistic=f"{evolved.mean():.2g} against {founders.mean():.2g}; one-sided paired t-test, {evolved.size} runs",
        p=p,
        runs_a_pair=1,
        verdict=verdict_of(ratio.estimate <= claim.threshold and p < LEVEL, p < LEVEL),
    )


MEASURES: Mapping[str, Callable[[Claim, Sequence[Row]], Measured]] = {
    "similar-curves": partial(_similar_curves, "worn"),
    "similar-curves-delayed": partial(_similar_curves, "delayed"),
    "shaping-learns-more": partial(_captures_more, "life_own"),
    "shaping-transfers": partial(_captures_more, "life_worn"),
    "shaping-transfers-delayed": partial(_captures_more, "life_delayed"),
    "greedy": _greedy,
    "small-lambda": _small_lambda,
}
