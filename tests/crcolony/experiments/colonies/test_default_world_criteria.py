"""Every criterion of the default world is met by runs that meet it, and failed by runs that just do not."""

import numpy as np
import pytest

from crcolony.experiments.colonies.default_world_criteria import check_criteria, uses_both
from tests.support.outcomes import outcomes_of

RUNS = 20
NOISE = np.random.default_rng(1).normal(0.0, 0.5, RUNS)
GROWTH, BOTH, STARVED, ENERGY, NOT_WORSE = range(5)


def verdicts(**columns: float | np.ndarray) -> list[bool]:
    """Return which criteria are met by implicit selection with these columns, beside central selection."""
    own = {"energy_weighted_matings_end": 7.0 + NOISE, **columns}
    runs = outcomes_of("implicit", RUNS, **own)
    central = outcomes_of("central", RUNS, energy_weighted_matings_end=7.0 + NOISE[::-1])
    return [criterion.passed for criterion in check_criteria([*runs, *central])]


def test_the_claims_are_those_of_the_issue() -> None:
    """Fifteenfold, 95 % of the runs, 5 % starved, an effect above 0, and 10 % less than central selection."""
    runs = outcomes_of("implicit", RUNS)
    criteria = check_criteria([*runs, *outcomes_of("central", RUNS)])
    assert [criterion.threshold for criterion in criteria] == [15.0, 0.95, 0.05, 0.0, 0.9]
    assert len({criterion.claim for criterion in criteria}) == 5
    assert verdicts() == [True] * 5


@pytest.mark.parametrize(
    ("criterion", "columns"),
    [
        (GROWTH, {"matings_end": 0.4 * 14.9}),
        (BOTH, {"mating_share_end": np.array([0.95, 0.05] + [0.6] * 18)}),
        (STARVED, {"starved_end": 0.051}),
        (ENERGY, {"energy_effect": NOISE}),
        (ENERGY, {"energy_effect": 0.0}),
        (NOT_WORSE, {"energy_weighted_matings_end": 6.3 + NOISE}),
    ],
)
def test_a_criterion_that_is_just_not_met_fails_alone(
    criterion: int, columns: dict[str, float | np.ndarray]
) -> None:
    """The others are still met."""
    assert verdicts(**columns) == [k != criterion for k in range(5)]


def test_what_is_just_enough_is_enough() -> None:
    """One run in 20 may use one module, and nearly 5 % may starve."""
    assert (
        verdicts(
            matings_end=0.4 * 15.1,
            mating_share_end=np.array([1.0] + [0.1] * 10 + [0.9] * 9),
            starved_end=0.0499,
            energy_effect=0.01,
        )
        == [True] * 5
    )


def test_not_worse_needs_more_than_a_difference_that_is_not_significant() -> None:
    """Runs that scatter so much that nothing can be said do not meet the criterion, though their mean is no worse."""
    scattered = 7.0 + 8.0 * NOISE
    assert not verdicts(energy_weighted_matings_end=scattered)[NOT_WORSE]


def test_runs_are_compared_with_those_of_the_same_seed() -> None:
    """Without central selection, or with other seeds only, there is no criterion that needs it."""
    runs = outcomes_of("implicit", 4)
    assert len(check_criteria(runs)) == 4
    assert len(check_criteria([*runs, *outcomes_of("central", 6)[4:]])) == 4
    assert check_criteria(outcomes_of("central", 4)) == []


def test_a_run_uses_both_modules_within_the_limits() -> None:
    """A tenth of the steps in either module is enough."""
    shares = np.array([0.0, 0.09, 0.1, 0.5, 0.9, 0.91])
    assert uses_both(outcomes_of("implicit", 6, mating_share_end=shares)) == 3
