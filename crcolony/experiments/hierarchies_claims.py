"""How the claims about evolved hierarchies are measured, from the rows of all runs."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Literal

import numpy as np

from crcolony.compiled import FloatArray, IntArray
from crcolony.experiments.framework.experiment import (
    Measured,
    Row,
    pairs_of,
    values_of,
    verdict_of,
)
from crcolony.experiments.framework.measured_pairs import measured_pairs
from crcolony.experiments.framework.registration import Claim
from crcolony.experiments.framework.statistics import (
    LEVEL,
    effect_size,
    equivalence,
    mean_interval,
    one_sided_p,
    ratio_interval,
)

IN_SIGHT, OUT_OF_SIGHT, WALLED = "in sight", "out of sight", "behind a wall"
ENVIRONMENTS = (IN_SIGHT, OUT_OF_SIGHT, WALLED)
"""The easiest first."""
WALL_IN_VIEW, LONG_LIVES = "wall in view", "long lives"
LONG_LIVED = (IN_SIGHT, WALL_IN_VIEW)
"""Environments in which lives are long enough to learn a mix of primitives in one."""
CHANGES = ("conflicting", "harmless")
SENSES = ("unsensed", "sensed")
DARWINIAN, LAMARCKIAN = "Darwinian", "Lamarckian"
INHERITANCES = (DARWINIAN, LAMARCKIAN)
DRIFT = "drift"
EDGE = "edge "
"""Before the two subtasks, in the names of columns."""
_PERMUTATIONS = 10_000
Measure = Callable[[Claim, Sequence[Row]], Measured]


def condition_of(*parts: str) -> str:
    """Return the name of a condition."""
    return ", ".join(parts)


def profiles_of(rows: Sequence[Row], inheritance: str) -> tuple[FloatArray, IntArray]:
    """Return the profiles of all runs (runs, edges), and the index of each one's environment (runs,).

    A profile is, for each edge that there can be, the share of a run's last trees that have it.
    """
    edges = sorted({name for row in rows for name in row if name.startswith(EDGE)})
    profiles = [
        np.stack([values_of(rows, edge, condition_of(name, inheritance)) for edge in edges], axis=1)
        for name in ENVIRONMENTS
    ]
    groups = np.repeat(np.arange(len(profiles)), [len(one) for one in profiles])
    return np.concatenate(profiles), groups


def variance_between(profiles: FloatArray, groups: IntArray) -> float:
    """Return the share of the variance of profiles (runs, edges) that is between groups (runs,)."""
    centred = profiles - profiles.mean(axis=0)
    members = (groups == np.unique(groups)[:, None]).astype(np.float64)
    sizes = members.sum(axis=1)
    means = members @ centred / sizes[:, None]
    total = float((centred**2).sum())
    return float(sizes @ (means**2).sum(axis=1)) / total if total > 0.0 else 0.0


def _follows_environment(claim: Claim, rows: Sequence[Row]) -> Measured:
    shares, p_values, runs = [], [], 0
    for inheritance in INHERITANCES:
        profiles, groups = profiles_of(rows, inheritance)
        found = variance_between(profiles, groups)
        rng = np.random.default_rng(0)
        drawn = [variance_between(profiles, rng.permutation(groups)) for _ in range(_PERMUTATIONS)]
        shares.append(found)
        p_values.append((1 + sum(one >= found for one in drawn)) / (1 + _PERMUTATIONS))
        runs += groups.size
    are_met = [s > claim.threshold and p < LEVEL for s, p in zip(shares, p_values, strict=True)]
    return Measured(
        estimate=min(shares),
        statistic="R² of environments, permutations of runs (PERMANOVA): "
        + ", ".join(
            f"{name} {share:.3f}, p = {p:.2g}"
            for name, share, p in zip(INHERITANCES, shares, p_values, strict=True)
        ),
        p=max(p_values),
        effect="R²",
        effect_size=min(shares),
        runs=runs,
        verdict=verdict_of(all(are_met), any(are_met)),
    )


def _minimal(inheritance: str, claim: Claim, rows: Sequence[Row]) -> Measured:
    column = "primitives_per_situation"
    per_environment = [
        pairs_of(rows, column, condition_of(name, inheritance), DRIFT) for name in ENVIRONMENTS
    ]
    ratios = [ratio_interval(evolved, drifted) for evolved, drifted in per_environment]
    p_values = [one_sided_p(evolved - drifted, 0.0, "less") for evolved, drifted in per_environment]
    are_met = [
        ratio.estimate < claim.threshold and p < LEVEL
        for ratio, p in zip(ratios, p_values, strict=True)
    ]
    worst = int(np.argmax([ratio.estimate for ratio in ratios]))
    evolved, drifted = per_environment[worst]
    return Measured(
        estimate=ratios[worst].estimate,
        low=ratios[worst].low,
        high=ratios[worst].high,
        statistic="; ".join(
            f"{name} {one.mean():.2f} of {other.mean():.2f}, p = {p:.2g}"
            for name, (one, other), p in zip(ENVIRONMENTS, per_environment, p_values, strict=True)
        ),
        p=max(p_values),
        effect="A12",
        effect_size=effect_size(evolved, drifted),
        runs=sum(2 * one.size for one, _ in per_environment),
        verdict=verdict_of(all(are_met), any(are_met)),
    )


def _differs(
    alternative: Literal["less", "greater"],
    column: str,
    cell: Sequence[str],
    claim: Claim,
    rows: Sequence[Row],
) -> Measured:
    """Measure whether Lamarckian runs have more packs than Darwinian ones, or less, and by the factor claimed."""
    lamarckian, darwinian = _inheritances(rows, column, *cell)
    ratio = ratio_interval(lamarckian, darwinian)
    p = one_sided_p(lamarckian - darwinian, 0.0, alternative)
    is_beyond = (
        ratio.estimate > claim.threshold
        if alternative == "greater"
        else ratio.estimate < claim.threshold
    )
    return measured_pairs(
        ratio,
        lamarckian,
        darwinian,
        statistic=f"{lamarckian.mean():.1f} of {darwinian.mean():.1f} packs;"
        f" one-sided paired t-test, {lamarckian.size} pairs",
        p=p,
        verdict=verdict_of(is_beyond and p < LEVEL, p < LEVEL),
    )


def _not_ahead(cell: Sequence[str], claim: Claim, rows: Sequence[Row]) -> Measured:
    lamarckian, darwinian = _inheritances(rows, "fitness_end", *cell)
    ratio = ratio_interval(lamarckian, darwinian)
    found = equivalence(lamarckian, darwinian, _margin(claim.threshold, darwinian))
    return measured_pairs(
        ratio,
        lamarckian,
        darwinian,
        statistic=f"{lamarckian.mean():.1f} of {darwinian.mean():.1f} packs; not ahead by"
        f" {claim.threshold:.0%}: one-sided paired t-test, {lamarckian.size} pairs",
        p=found.p_superior,
        verdict=verdict_of(found.p_superior < LEVEL),
    )


def _grows_with_difficulty(claim: Claim, rows: Sequence[Row]) -> Measured:
    hard, easy = (
        np.log(np.maximum(one, 1e-12)) - np.log(np.maximum(other, 1e-12))
        for one, other in (_inheritances(rows, "fitness_end", name) for name in (WALLED, IN_SIGHT))
    )
    mean = mean_interval(hard - easy)
    p = one_sided_p(hard - easy, 0.0, "greater")
    return Measured(
        estimate=mean.estimate,
        low=mean.low,
        high=mean.high,
        statistic=f"{hard.mean():.3f} and {easy.mean():.3f}; one-sided paired t-test",
        p=p,
        effect="A12",
        effect_size=effect_size(hard, easy),
        runs=4 * hard.size,
        verdict=verdict_of(mean.estimate > claim.threshold and p < LEVEL),
    )


def _does_not_lose(change: str, sense: str, claim: Claim, rows: Sequence[Row]) -> Measured:
    lamarckian, darwinian = _inheritances(rows, "fitness_late", change, sense)
    ratio = ratio_interval(lamarckian, darwinian)
    found = equivalence(lamarckian, darwinian, _margin(claim.threshold, darwinian))
    return measured_pairs(
        ratio,
        lamarckian,
        darwinian,
        statistic=f"{lamarckian.mean():.1f} of {darwinian.mean():.1f} packs; not behind by"
        f" {claim.threshold:.0%}: one-sided paired t-test, {lamarckian.size} pairs",
        p=found.p_inferior,
        verdict=verdict_of(found.p_inferior < LEVEL, ratio.estimate >= 1.0),
    )


def _inheritances(
    rows: Sequence[Row], column: str, *condition: str
) -> tuple[FloatArray, FloatArray]:
    """Return a column of the runs with Lamarckian and with Darwinian inheritance, in pairs."""
    lamarckian, darwinian = (condition_of(*condition, one) for one in (LAMARCKIAN, DARWINIAN))
    return pairs_of(rows, column, lamarckian, darwinian)


def _margin(share: float, values: FloatArray) -> float:
    return share * max(float(values.mean()), 1e-12)


MEASURES: Mapping[str, Measure] = {
    "follows-environment": _follows_environment,
    "minimal-darwinian": partial(_minimal, DARWINIAN),
    "minimal-lamarckian": partial(_minimal, LAMARCKIAN),
    "lamarckian-ahead": partial(_differs, "greater", "fitness_end", (WALLED,)),
    "lamarckian-not-ahead": partial(_not_ahead, (IN_SIGHT,)),
    "grows-with-difficulty": _grows_with_difficulty,
    "long-lives-ahead": partial(_differs, "greater", "fitness_end", (WALL_IN_VIEW, LONG_LIVES)),
    "long-lives-not-ahead": partial(_not_ahead, (IN_SIGHT, LONG_LIVES)),
    "conflicting-unsensed": partial(_differs, "less", "fitness_late", (CHANGES[0], SENSES[0])),
    "conflicting-sensed": partial(_does_not_lose, CHANGES[0], SENSES[1]),
    "harmless-unsensed": partial(_does_not_lose, CHANGES[1], SENSES[0]),
    "harmless-sensed": partial(_does_not_lose, CHANGES[1], SENSES[1]),
}
