"""How the claims about learners and frozen policies in pseudo-realities are measured, from the rows of all runs."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.experiments.framework.experiment import Measured, Row, values_of, verdict_of
from crcolony.experiments.framework.measured_pairs import measured_pairs, measured_ratio
from crcolony.experiments.framework.registration import Claim
from crcolony.experiments.framework.statistics import (
    LEVEL,
    mean_interval,
    one_sided_p,
)

NEWBORN, FROZEN, LEARNING_ON = "newborn", "frozen", "learning_on"
AT_CENTRE, AT_EDGE = "centre", "edge"


def _drops(home: str, claim: Claim, rows: Sequence[Row]) -> Measured:
    at_home, away = (values_of(rows, f"life_frozen_{where}", home) for where in ("home", "away"))
    lost = values_of(rows, f"loss_{FROZEN}", home)
    p = one_sided_p(lost, claim.threshold, "greater")
    found = mean_interval(lost)
    return measured_pairs(
        found,
        at_home,
        away,
        statistic=f"{at_home.mean():.1f} packs of a life at home, {away.mean():.1f} away; one-sided t-test,"
        f" {lost.size} runs",
        p=p,
        verdict=verdict_of(found.estimate > claim.threshold and p < LEVEL),
        runs_a_pair=1,
    )


def _loses_less(kind: str, home: str, where: str, claim: Claim, rows: Sequence[Row]) -> Measured:
    """Measure by how much less of its packs a kind loses than frozen policies do, in pairs of one run."""
    frozen, other = (values_of(rows, f"loss_{one}{where}", home) for one in (FROZEN, kind))
    is_there = ~np.isnan(frozen) & ~np.isnan(other)
    frozen, other = frozen[is_there], other[is_there]
    found = mean_interval(frozen - other)
    p = one_sided_p(frozen - other, 0.0, "greater")
    p_more = one_sided_p(frozen - other, 0.0, "less")
    return measured_pairs(
        found,
        frozen,
        other,
        statistic=f"{other.mean():.0%} is lost of {_packs_at_home(rows, kind, home):.1f} packs, {frozen.mean():.0%} of"
        f" {_packs_at_home(rows, FROZEN, home):.1f} frozen; d = {_cohen_d(frozen - other):.2f} of pairs; one-sided"
        f" paired t-test, {frozen.size} pairs, that more is lost: p = {p_more:.2g}",
        p=p,
        verdict=verdict_of(found.estimate > claim.threshold and p < LEVEL),
        runs_a_pair=1,
    )


def _packs_at_home(rows: Sequence[Row], kind: str, home: str) -> float:
    return float(values_of(rows, f"life_{kind}_home", home).mean())


def _cohen_d(differences: FloatArray) -> float:
    """Return the mean of paired differences in units of their standard deviation (Cohen 1988); NaN if all are alike."""
    deviation = float(differences.std(ddof=1))
    return float(differences.mean()) / deviation if deviation > 0.0 else float("nan")


def _captures_more(column: str, home: str, claim: Claim, rows: Sequence[Row]) -> Measured:
    newborn, frozen = (values_of(rows, f"{column}_{one}_away", home) for one in (NEWBORN, FROZEN))
    return measured_ratio(
        claim,
        newborn,
        frozen,
        statistic=f"{newborn.mean():.1f} against {frozen.mean():.1f} packs; one-sided paired t-test,"
        f" {newborn.size} pairs",
        runs_a_pair=1,
    )


_LATER = "_delay_2"
"""In worlds that act a step later than the centre."""

MEASURES: Mapping[str, Callable[[Claim, Sequence[Row]], Measured]] = {
    "performance-drops": partial(_drops, AT_CENTRE),
    "performance-drops-edge": partial(_drops, AT_EDGE),
    "learners-lose-less": partial(_loses_less, NEWBORN, AT_CENTRE, ""),
    "learners-lose-less-edge": partial(_loses_less, NEWBORN, AT_EDGE, ""),
    "learners-lose-less-later": partial(_loses_less, NEWBORN, AT_CENTRE, _LATER),
    "learning-on-loses-less": partial(_loses_less, LEARNING_ON, AT_CENTRE, ""),
    "learning-on-loses-less-edge": partial(_loses_less, LEARNING_ON, AT_EDGE, ""),
    "learners-overtake": partial(_captures_more, "late", AT_CENTRE),
}
