"""How the claims about faults are measured, from the rows of all runs."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np
from scipy import stats

from crcolony.compiled import FloatArray
from crcolony.experiments.framework.experiment import Measured, Row, pairs_of, values_of, verdict_of
from crcolony.experiments.framework.measured_pairs import measured_pairs
from crcolony.experiments.framework.registration import Claim
from crcolony.experiments.framework.statistics import (
    LEVEL,
    equivalence,
    holm,
    mean_interval,
    one_sided_p,
    ratio_interval,
)
from crcolony.robot.genes import META_PARAMETERS
from crcolony.robot.modules import MODULES

LOSSES = (0.0, 0.1, 0.2, 0.4)
"""Shares of messages that get lost"""
KILLS = (0.0, 10.0)
"""Of each robot, an hour"""


def condition_of(loss: float, kills: float) -> str:
    """Return the name of the condition with these faults."""
    return f"loss-{100 * loss:g}-kills-{kills:g}"


NONE = condition_of(0.0, 0.0)
LOSS, KILLED, BOTH = condition_of(0.4, 0.0), condition_of(0.0, 10.0), condition_of(0.4, 10.0)
WITH_CONTROL = (LOSS, BOTH)
"""With less loss hardly any mating fails, so that there is nothing to lose at random"""
RANDOM = "random_"
"""Before the columns of a control"""
NEUTRAL = "_neutral"
"""After those of a neutral gene"""
_META = {
    f"{module.name}_{meta}": f"{module.name}.{meta}"
    for module in MODULES
    for meta in META_PARAMETERS
}
GENES = tuple(_META)
STRATEGY = ("waiting", "choosiness", "tracking", "mating_energy", "mating_share")


def gene_name(column: str) -> str:
    """Return the name of the gene of a column."""
    return _META[column]


def effect_of(rows: Sequence[Row], condition: str, column: str) -> tuple[float, float, float]:
    """Return by how much faults move a column: the mean paired difference over its standard deviation.

    It is the second of three; the others are the ends of the 95 % interval of the mean, over the same.
    """
    faulty, faultless = pairs_of(rows, column, condition, NONE)
    differences = faulty - faultless
    sd = _spread(differences)
    mean = mean_interval(differences)
    return mean.low / sd, mean.estimate / sd, mean.high / sd


def _spread(differences: FloatArray) -> float:
    sd = float(differences.std(ddof=1)) if differences.size > 1 else 0.0
    return max(sd, 1e-12)


def _delivered(claim: Claim, rows: Sequence[Row]) -> Measured:
    failed = values_of(rows, "failed", LOSS)
    mean = mean_interval(failed)
    p = one_sided_p(failed, claim.threshold, "less")
    shares = ", ".join(
        f"{values_of(rows, 'failed', condition_of(loss, kills)).mean():.2%}"
        for kills in KILLS
        for loss in LOSSES
    )
    wait_s = values_of(rows, "wait_s", LOSS).mean()
    return Measured(
        estimate=mean.estimate,
        low=mean.low,
        high=mean.high,
        statistic=f"loss of 0, 10, 20 and 40 %, without kills and with: {shares}; at 40 % a decision takes"
        f" {wait_s:.2g} s; one-sided t-test, {failed.size} runs",
        p=p,
        runs=failed.size,
        verdict=verdict_of(mean.estimate < claim.threshold and p < LEVEL),
    )


def _conceptions_fall(claim: Claim, rows: Sequence[Row]) -> Measured:
    by_loss = [
        np.mean(
            [values_of(rows, "conceptions_end", condition_of(loss, kills)) for kills in KILLS],
            axis=0,
        )
        for loss in LOSSES
    ]
    slopes = np.polyfit(LOSSES, np.array(by_loss), 1)[0]
    mean = mean_interval(slopes)
    p = one_sided_p(slopes, claim.threshold, "less")
    means = ", ".join(f"{values.mean():.2f}" for values in by_loss)
    return Measured(
        estimate=mean.estimate,
        low=mean.low,
        high=mean.high,
        statistic=f"conceptions {means}; one-sided t-test, {slopes.size} seeds",
        p=p,
        effect="d",
        effect_size=mean.estimate / _spread(slopes),
        runs=slopes.size * len(LOSSES) * len(KILLS),
        verdict=verdict_of(p < LEVEL),
    )


def _evolves(condition: str, claim: Claim, rows: Sequence[Row]) -> Measured:
    faulty, faultless = pairs_of(rows, "matings_end", condition, NONE)
    margin = (1.0 - claim.threshold) * max(float(faultless.mean()), 1e-12)
    p = equivalence(faulty, faultless, margin).p_inferior
    ratio = ratio_interval(faulty, faultless)
    return measured_pairs(
        ratio,
        faulty,
        faultless,
        statistic=f"{faulty.mean():.2f} against {faultless.mean():.2f}; one-sided paired t-test,"
        f" {faulty.size} pairs",
        p=p,
        verdict=verdict_of(p < LEVEL, ratio.estimate >= claim.threshold),
    )


def _moves(
    columns: Sequence[str],
    pairs: Callable[[Sequence[Row], str], tuple[FloatArray, FloatArray]],
    claim: Claim,
    rows: Sequence[Row],
) -> Measured:
    """Measure whether any of some columns differs between the two sides of pairs, corrected for their number."""
    found = {column: pairs(rows, column) for column in columns}
    p_values = [float(stats.ttest_rel(*sides).pvalue) for sides in found.values()]
    corrected = dict(zip(columns, holm(np.nan_to_num(p_values, nan=1.0).tolist()), strict=True))
    first = min(columns, key=lambda column: corrected[column])
    one, other = found[first]
    differences = one - other
    sd = _spread(differences)
    mean = mean_interval(differences)
    moved = [column for column in columns if corrected[column] < claim.threshold]
    words = ", ".join(f"{c} {_change(*found[c])}" for c in moved) or "no effect"
    return Measured(
        estimate=mean.estimate / sd,
        low=mean.low / sd,
        high=mean.high / sd,
        statistic=f"{words}; smallest p: {first} {_change(one, other)}; paired t-tests, Holm over"
        f" {len(columns)}, {one.size} pairs",
        p=corrected[first],
        effect="d",
        effect_size=mean.estimate / sd,
        runs=2 * one.size,
        verdict=verdict_of(bool(moved)),
    )


def _change(one: FloatArray, other: FloatArray) -> str:
    return f"{one.mean():.3g} for {other.mean():.3g}"


def _against_none(
    condition: str, rows: Sequence[Row], column: str
) -> tuple[FloatArray, FloatArray]:
    return pairs_of(rows, column, condition, NONE)


def _at_random(column: str) -> str:
    return f"{RANDOM}{column}"


def _if_neutral(column: str) -> str:
    return f"{column}{NEUTRAL}"


def _beside(
    condition: str, name: Callable[[str], str], rows: Sequence[Row], column: str
) -> tuple[FloatArray, FloatArray]:
    """Return a column of a condition, and the one beside it that `name` gives, of the rows that have both."""
    both = [row for row in rows if column in row and name(column) in row]
    return values_of(both, column, condition), values_of(both, name(column), condition)


MEASURES: Mapping[str, Callable[[Claim, Sequence[Row]], Measured]] = {
    "delivered": _delivered,
    "conceptions-fall": _conceptions_fall,
    "evolves-with-loss": partial(_evolves, LOSS),
    "evolves-with-kills": partial(_evolves, KILLED),
    "evolves-with-both": partial(_evolves, BOTH),
    "genes-loss": partial(_moves, GENES, partial(_against_none, LOSS)),
    "genes-kills": partial(_moves, GENES, partial(_against_none, KILLED)),
    "genes-both": partial(_moves, GENES, partial(_against_none, BOTH)),
    "strategy-loss": partial(_moves, STRATEGY, partial(_against_none, LOSS)),
    "strategy-kills": partial(_moves, STRATEGY, partial(_against_none, KILLED)),
    "strategy-both": partial(_moves, STRATEGY, partial(_against_none, BOTH)),
    "loss-or-chance": partial(_moves, (*GENES, *STRATEGY), partial(_beside, LOSS, _at_random)),
    "both-or-chance": partial(_moves, (*GENES, *STRATEGY), partial(_beside, BOTH, _at_random)),
    "selection-stands": partial(_moves, GENES, partial(_beside, BOTH, _if_neutral)),
}
