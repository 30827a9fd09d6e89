"""How the claims of Paper III are measured, from the rows of all runs."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.config import Config
from crcolony.experiments.colonies.default_world_criteria import MARGIN
from crcolony.experiments.framework.experiment import Measured, Row, pairs_of, values_of, verdict_of
from crcolony.experiments.framework.measured_pairs import measured_pairs, measured_ratio
from crcolony.experiments.framework.registration import Claim
from crcolony.experiments.framework.similar_curves import measure_similar_curves
from crcolony.experiments.framework.statistics import (
    LEVEL,
    equivalence,
    mean_interval,
    mean_pairwise_correlation,
    one_sided_p,
    rank_correlation,
    ratio_interval,
)

IMPLICIT, CENTRAL = "implicit", "central"
POTENTIALS = tuple(
    f"mating_potential_{k}"
    for k in range(Config().learning.potential_distances * Config().learning.potential_bearings)
)
"""The columns of the mean potential of mating at the end of a run"""


def _parity(claim: Claim, rows: Sequence[Row]) -> Measured:
    own, central = pairs_of(rows, "energy_weighted_matings_end", IMPLICIT, CENTRAL)
    found = equivalence(own, central, MARGIN * max(float(central.mean()), 1e-12))
    ratio = ratio_interval(own, central)
    return measured_pairs(
        ratio,
        own,
        central,
        statistic=f"not worse by {MARGIN:.0%}: paired t-test, {own.size} pairs; equal within {MARGIN:.0%}:"
        f" p = {found.p:.2g}",
        p=found.p_inferior,
        verdict=verdict_of(found.p_inferior < LEVEL, ratio.estimate >= claim.threshold),
    )


def _better_start(claim: Claim, rows: Sequence[Row]) -> Measured:
    own, central = pairs_of(rows, "matings_early", IMPLICIT, CENTRAL)
    return measured_ratio(
        claim, own, central, statistic=f"one-sided paired t-test, {own.size} pairs"
    )


def _tau(module: str, claim: Claim, rows: Sequence[Row]) -> Measured:
    evolved = values_of(rows, f"{module}_tau_end", IMPLICIT)
    neutral = values_of(rows, f"{module}_tau_neutral", IMPLICIT)
    mean = mean_interval(evolved)
    p = one_sided_p(evolved - neutral, 0.0, "less")
    return measured_pairs(
        mean,
        evolved,
        neutral,
        statistic=f"neutral genes end at {neutral.mean():.2f}; one-sided paired t-test against them",
        p=p,
        runs_a_pair=1,
        verdict=verdict_of(mean.estimate <= claim.threshold and p < LEVEL, p < LEVEL),
    )


def _lambda(claim: Claim, rows: Sequence[Row]) -> Measured:
    matings = values_of(rows, "matings_end", IMPLICIT)
    found = rank_correlation(matings, values_of(rows, "mating_lambda_end", IMPLICIT))
    return Measured(
        estimate=found.rho,
        low=found.low,
        high=found.high,
        statistic="Spearman",
        p=found.p,
        effect="ρ",
        effect_size=found.rho,
        runs=matings.size,
        verdict=verdict_of(found.rho < claim.threshold and found.p < LEVEL),
    )


def _potentials(claim: Claim, rows: Sequence[Row]) -> Measured:
    potentials: FloatArray = np.stack(
        [values_of(rows, name, IMPLICIT) for name in POTENTIALS], axis=1
    )
    found = mean_pairwise_correlation(potentials)
    return Measured(
        estimate=found.estimate,
        low=found.low,
        high=found.high,
        statistic="bootstrap over runs",
        effect="r",
        effect_size=found.estimate,
        runs=len(potentials),
        verdict=verdict_of(found.high < claim.threshold, found.estimate < claim.threshold),
    )


def _similar_learning(what: str, body: str, claim: Claim, rows: Sequence[Row]) -> Measured:
    column = f"transfer_{what}_{{part}}_{{body}}"
    return measure_similar_curves(claim, rows, IMPLICIT, column, (body, "own"), what)


MEASURES: Mapping[str, Callable[[Claim, Sequence[Row]], Measured]] = {
    "parity": _parity,
    "better-start": _better_start,
    "tau-mating": partial(_tau, "mating"),
    "tau-foraging": partial(_tau, "foraging"),
    "lambda-matings": _lambda,
    "potentials-differ": _potentials,
    "mating-transfers": partial(_similar_learning, "matings", "worn"),
    "foraging-transfers": partial(_similar_learning, "captures", "worn"),
    "mating-transfers-delayed": partial(_similar_learning, "matings", "delayed"),
    "foraging-transfers-delayed": partial(_similar_learning, "captures", "delayed"),
}
