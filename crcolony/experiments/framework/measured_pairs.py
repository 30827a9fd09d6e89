"""What was measured of a claim that compares pairs: two conditions, a run of each for every seed, or two columns."""

import math

from crcolony.compiled import FloatArray
from crcolony.experiments.framework.experiment import Measured, Verdict
from crcolony.experiments.framework.statistics import Interval, effect_size


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
