"""What was measured of a claim about the share of runs in which something happens."""

from scipy import stats

from crcolony.compiled import BoolArray
from crcolony.experiments.framework.experiment import Measured, verdict_of
from crcolony.experiments.framework.registration import Claim
from crcolony.experiments.framework.statistics import LEVEL, Interval


def share_interval(successes: BoolArray) -> Interval:
    """Return the share of runs (runs,) that succeed, with its exact 95 % interval (Clopper and Pearson 1934)."""
    found = stats.binomtest(int(successes.sum()), successes.size).proportion_ci(1.0 - LEVEL)
    return Interval(float(successes.mean()), float(found.low), float(found.high))


def measured_share(claim: Claim, successes: BoolArray) -> Measured:
    """Measure that at least the threshold of a claim, and more than one half, of the runs (runs,) succeed."""
    count, runs = int(successes.sum()), successes.size
    p = float(stats.binomtest(count, runs, 0.5, "greater").pvalue)
    share = share_interval(successes)
    return Measured(
        estimate=share.estimate,
        low=share.low,
        high=share.high,
        statistic=f"{count} of {runs} runs; exact binomial test against one half",
        p=p,
        runs=runs,
        verdict=verdict_of(share.estimate >= claim.threshold and p < LEVEL, p < LEVEL),
    )
