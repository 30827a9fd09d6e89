"""What was measured of a claim that compares pairs: two conditions, a run of each for every seed, or two columns."""

import math
from typing import Literal

from crcolony.compiled import FloatArray
from crcolony.experiments.framework.experiment import Measured, Verdict, verdict_of
from crcolony.experiments.framework.registration import Claim
from crcolony.experiments.framework.statistics import (
    LEVEL,
    Interval,
    effect_size,
    one_sided_p,
    ratio_interval,
)


def measured_pairs(
    found: Interval,
    one: FloatArray,
    other: FloatArray,
    *,
    statistic: str,
    verdict: Verdict,
    p: float = math.nan,
    runs_a_pair: int = 2,
) -> Measured:
    """Return an estimate over pairs, (pairs,) each, with A12 as its effect size (Vargha & Delaney 2000).

    Two columns of the same runs are one run a pair.
    """
    return Measured(
        estimate=found.estimate,
        low=found.low,
        high=found.high,
        statistic=statistic,
        p=p,
        effect="A12",
        effect_size=effect_size(one, other),
        runs=runs_a_pair * one.size,
        verdict=verdict,
    )


def measured_ratio(
    claim: Claim,
    one: FloatArray,
    other: FloatArray,
    *,
    statistic: str,
    alternative: Literal["greater", "less"] = "greater",
    runs_a_pair: int = 2,
) -> Measured:
    """Measure the ratio of the means of pairs, (pairs,) each, which is to be beyond the threshold of a claim.

    That one is beyond the other is the one-sided paired t-test.
    """
    ratio = ratio_interval(one, other)
    p = one_sided_p(one - other, 0.0, alternative)
    is_beyond = (
        ratio.estimate > claim.threshold
        if alternative == "greater"
        else ratio.estimate < claim.threshold
    )
    return measured_pairs(
        ratio,
        one,
        other,
        statistic=statistic,
        p=p,
        verdict=verdict_of(is_beyond and p < LEVEL),
        runs_a_pair=runs_a_pair,
    )
