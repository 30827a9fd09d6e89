"""How the claims about the taxi are measured, from the rows of all runs."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np

from crcolony.experiments.framework.experiment import Measured, Row, pairs_of, values_of, verdict_of
from crcolony.experiments.framework.registration import Claim
from crcolony.experiments.framework.statistics import (
    LEVEL,
    effect_size,
    mean_interval,
    one_sided_p,
    ratio_interval,
)

FLAT, PLAIN, ABSTRACT = "flat", "plain", "abstract"
LEARNERS = {FLAT: "flat Q-learning", PLAIN: "MAXQ-Q", ABSTRACT: "MAXQ-Q with abstraction"}
IN_PLACE, IN_ADDITION = "in place", "in addition"
CONVENTIONS = (IN_PLACE, IN_ADDITION)

EXAMPLE = {
    "example_value": ("V(Root)", 10.0),
    "example_north": ("V(North)", -1.0),
    "example_navigate": ("C(Navigate(R), North)", 0.0),
    "example_get": ("C(Get, Navigate(R))", -1.0),
    "example_root": ("C(Root, Get)", 12.0),
}
"""By the column, the terms of equation 3.16 and what they are."""
_ENTRIES = {FLAT: 3_000, PLAIN: 14_000, ABSTRACT: 632}
_NEAR = 0.005
"""The mean of V* is known to two decimals."""


def condition_of(learner: str, convention: str) -> str:
    """Return the name of a condition."""
    return f"{learner}, {convention}"


def _example(claim: Claim, rows: Sequence[Row]) -> Measured:
    condition = condition_of(ABSTRACT, IN_ADDITION)
    columns = [values_of(rows, name, condition) for name in EXAMPLE]
    runs = values_of(rows, "entries", condition).size
    is_complete = all(column.size == runs for column in columns)
    errors = [abs(c - known) for c, (_, known) in zip(columns, EXAMPLE.values(), strict=True)]
    worst = float(max(error.max(initial=0.0) for error in errors)) if is_complete else np.nan
    return Measured(
        estimate=worst,
        statistic=f"V(Root, s1) = {columns[0].mean():.6g} on average",
        runs=runs,
        verdict=verdict_of(worst < claim.threshold),
    )


def _entries(claim: Claim, rows: Sequence[Row]) -> Measured:
    counts = {
        learner: {
            int(n)
            for c in CONVENTIONS
            for n in values_of(rows, "entries", condition_of(learner, c))
        }
        for learner in LEARNERS
    }
    stored = {learner: max(found) for learner, found in counts.items()}
    return Measured(
        estimate=stored[ABSTRACT],
        statistic=f"{stored[PLAIN]:,} without abstraction, {stored[FLAT]:,} flat",
        runs=sum("entries" in row for row in rows),
        verdict=verdict_of(
            stored[ABSTRACT] == claim.threshold
            and all(counts[learner] == {known} for learner, known in _ENTRIES.items())
        ),
    )


def _optimum(convention: str, claim: Claim, rows: Sequence[Row]) -> Measured:
    returns, optimal = (
        {
            learner: values_of(rows, column, condition_of(learner, convention))
            for learner in (PLAIN, ABSTRACT)
        }
        for column in ("final_greedy_return", "greedy_optimal")
    )
    found = mean_interval(np.concatenate(list(returns.values())))
    is_met = {
        learner: bool(np.all(optimal[learner] == 1.0))
        and abs(float(returns[learner].mean()) - claim.threshold) < _NEAR
        for learner in returns
    }
    share = {learner: f"{float((one == 1.0).mean()):.0%}" for learner, one in optimal.items()}
    return Measured(
        estimate=found.estimate,
        low=found.low,
        high=found.high,
        statistic=f"optimal from every start in {share[ABSTRACT]} of the runs with abstraction, {share[PLAIN]} without",
        runs=sum(one.size for one in optimal.values()),
        verdict=verdict_of(all(is_met.values()), is_met[ABSTRACT]),
    )


def _is_above(column: str, one: str, other: str, claim: Claim, rows: Sequence[Row]) -> Measured:
    """Measure the difference of two learners in a column, in both conventions."""
    pairs = {
        convention: pairs_of(
            rows, column, condition_of(one, convention), condition_of(other, convention)
        )
        for convention in CONVENTIONS
    }
    above = {convention: first - second for convention, (first, second) in pairs.items()}
    p = {name: one_sided_p(found, claim.threshold, "greater") for name, found in above.items()}
    found = mean_interval(above[IN_PLACE])
    first, second = pairs[IN_PLACE]
    return Measured(
        estimate=found.estimate,
        low=found.low,
        high=found.high,
        statistic=f"{first.mean():.2f} against {second.mean():.2f}, in addition"
        f" {above[IN_ADDITION].mean():.2f} more; one-sided paired t-tests, {first.size} pairs",
        p=max(p.values()),
        effect="A12",
        effect_size=effect_size(first, second),
        runs=sum(2 * found.size for found in above.values()),
        verdict=verdict_of(max(p.values()) < LEVEL, min(p.values()) < LEVEL),
    )


def _fastest(claim: Claim, rows: Sequence[Row]) -> Measured:
    ratios, p, sizes = {}, {}, []
    for convention in CONVENTIONS:
        own, *others = (
            values_of(rows, "steps_to_optimum", condition_of(learner, convention))
            for learner in (ABSTRACT, PLAIN, FLAT)
        )
        nearest = min(others, key=lambda steps: float(steps.mean()))
        ratios[convention] = ratio_interval(own, nearest)
        p[convention] = one_sided_p(nearest - own, 0.0, "greater")
        sizes.append((own, nearest))
    worst = max(p.values())
    is_met = all(found.estimate < claim.threshold for found in ratios.values())
    own, nearest = sizes[0]
    return Measured(
        estimate=ratios[IN_PLACE].estimate,
        low=ratios[IN_PLACE].low,
        high=ratios[IN_PLACE].high,
        statistic=f"{own.mean():,.0f} against {nearest.mean():,.0f} steps, in addition a ratio of"
        f" {ratios[IN_ADDITION].estimate:.2f}; one-sided paired t-tests, {own.size} pairs",
        p=worst,
        effect="A12",
        effect_size=effect_size(nearest, own),
        runs=sum(2 * own.size for own, _ in sizes),
        verdict=verdict_of(is_met and worst < LEVEL, worst < LEVEL),
    )


def _level(claim: Claim, rows: Sequence[Row]) -> Measured:
    values = values_of(rows, "return_settled", condition_of(ABSTRACT, IN_PLACE))
    found = mean_interval(values)
    return Measured(
        estimate=found.estimate,
        low=found.low,
        high=found.high,
        statistic="bootstrap over runs",
        runs=values.size,
        verdict=verdict_of(found.low > claim.threshold, found.estimate > claim.threshold),
    )


MEASURES: Mapping[str, Callable[[Claim, Sequence[Row]], Measured]] = {
    "example": _example,
    "table-entries": _entries,
    "optimum-in-place": partial(_optimum, IN_PLACE),
    "optimum-in-addition": partial(_optimum, IN_ADDITION),
    "better-start": partial(_is_above, "return_first", PLAIN, FLAT),
    "abstraction-is-fastest": _fastest,
    "abstraction-level": _level,
    "flat-is-behind": partial(_is_above, "return_middle", PLAIN, FLAT),
    "ahead-for-a-while": partial(_is_above, "return_ahead", FLAT, PLAIN),
    "overtaken": partial(_is_above, "return_last", FLAT, PLAIN),
}
