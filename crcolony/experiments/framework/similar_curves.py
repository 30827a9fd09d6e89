"""What was measured of a claim that two learning curves are similar: equal in each third of a life, within a margin."""

from collections.abc import Sequence

from scipy import stats

from crcolony.experiments.framework.experiment import Measured, Row, values_of, verdict_of
from crcolony.experiments.framework.measured_pairs import measured_pairs
from crcolony.experiments.framework.registration import Claim
from crcolony.experiments.framework.statistics import LEVEL, equivalence, ratio_interval

THIRDS = ("first", "second", "last")
"""The parts of a curve; what is in all of it is called `life`."""


def measure_similar_curves(
    claim: Claim,
    rows: Sequence[Row],
    condition: str,
    column: str,
    bodies: tuple[str, str],
    unit: str,
) -> Measured:
    """Measure a curve in a body against that in another one, the other first, of runs of a condition.

    `column` is the name of a column with `{part}`, a third or the life, and `{body}`. The margin is the claim's
    threshold, a share of the mean of the second. In part similar are curves of which only the sums are equal.
    """
    p = {part: _p_equal(claim, rows, condition, column, part, bodies) for part in (*THIRDS, "life")}
    p_thirds, p_life = max(p[third] for third in THIRDS), p["life"]
    other, own = (
        values_of(rows, column.format(part="life", body=body), condition) for body in bodies
    )
    p_differ = float(stats.ttest_rel(other, own).pvalue)
    return measured_pairs(
        ratio_interval(other, own),
        other,
        own,
        statistic=f"{other.mean():.1f} against {own.mean():.1f} {unit}; equal within {claim.threshold:.0%}: largest p"
        f" of three thirds, whole life p = {p_life:.2g}; different: two-sided paired t-test, p = {p_differ:.2g}",
        p=p_thirds,
        verdict=verdict_of(p_thirds < LEVEL, p_life < LEVEL),
        runs_a_pair=1,
    )


def _p_equal(
    claim: Claim,
    rows: Sequence[Row],
    condition: str,
    column: str,
    part: str,
    bodies: tuple[str, str],
) -> float:
    other, own = (
        values_of(rows, column.format(part=part, body=body), condition) for body in bodies
    )
    return equivalence(other, own, claim.threshold * max(float(own.mean()), 1e-12)).p
