"""How the claims about the evolution of survival and its transfer are measured, from the rows of all runs."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from crcolony.experiments.framework.experiment import (
    Measured,
    Row,
    pairs_of,
    values_of,
)
from crcolony.experiments.framework.measured_pairs import measured_ratio
from crcolony.experiments.framework.registration import Claim

AUTONOMOUS, CENTRAL = "autonomous", "central"


def _has_more(
    column: str, unit: str, more: str, less: str, claim: Claim, rows: Sequence[Row]
) -> Measured:
    """Measure that the runs of one selection have more of something than those of the other."""
    high, low = pairs_of(rows, column, more, less)
    return measured_ratio(
        claim,
        high,
        low,
        statistic=f"{high.mean():.2f} against {low.mean():.2f} {unit}; one-sided paired t-test, {high.size} pairs",
    )


def _rises(before: str, after: str, unit: str, claim: Claim, rows: Sequence[Row]) -> Measured:
    """Measure that something rises, from one column to another, in the runs of autonomous selection."""
    early, late = (values_of(rows, column, AUTONOMOUS) for column in (before, after))
    return measured_ratio(
        claim,
        late,
        early,
        statistic=f"from {early.mean():.2f} to {late.mean():.2f} {unit}; one-sided paired t-test, {late.size} runs",
        runs_a_pair=1,
    )


MEASURES: Mapping[str, Callable[[Claim, Sequence[Row]], Measured]] = {
    "central-captures-more": partial(_has_more, "captures_end", "packs", CENTRAL, AUTONOMOUS),
    "autonomous-mates-more": partial(_has_more, "matings_end", "matings", AUTONOMOUS, CENTRAL),
    "matings-rise": partial(_rises, "matings_first", "matings_end", "matings"),
    "captures-rise": partial(_rises, "captures_first", "captures_end", "packs"),
    "transfer-rises": partial(_rises, "captures_transferred", "captures_adapted", "packs"),
}
