"""A comparison of two conditions is described by its interval, its effect size and its runs."""

import math
from typing import Literal

import msgspec
import numpy as np
import pytest

from crcolony.experiments.framework.measured_pairs import measured_pairs, measured_ratio
from crcolony.experiments.framework.registration import parse_registration
from crcolony.experiments.framework.statistics import Interval, one_sided_p
from tests.support.fake_experiment import REGISTRATION


def test_pairs_have_two_runs_each_and_an_effect_size() -> None:
    """A12 is that of the first against the other; without a test there is no p."""
    one, other = np.array([2.0, 3.0, 4.0]), np.array([1.0, 2.0, 2.5])
    found = measured_pairs(
        Interval(1.6, 1.2, 2.0), one, other, statistic="by eye", verdict="partly"
    )
    assert (found.estimate, found.low, found.high) == (1.6, 1.2, 2.0)
    assert (found.statistic, found.verdict, found.runs) == ("by eye", "partly", 6)
    assert (found.effect, found.effect_size) == ("A12", 7.5 / 9.0)
    assert math.isnan(found.p)


@pytest.mark.parametrize(
    ("alternative", "threshold", "is_met"),
    [
        ("greater", 1.5, True),
        ("greater", 3.0, False),
        ("less", 3.0, False),  # the first are more, whatever the threshold
        ("less", 1.5, False),
    ],
)
def test_a_ratio_is_beyond_the_threshold_and_its_pairs_differ(
    alternative: Literal["greater", "less"], threshold: float, is_met: bool
) -> None:
    """Both are needed; two columns of the same runs are one run a pair."""
    (claim,) = parse_registration(REGISTRATION).claims
    claim = msgspec.structs.replace(claim, threshold=threshold)
    one, other = np.array([4.0, 4.2, 4.4, 3.9]), np.array([2.0, 2.2, 1.9, 2.1])
    found = measured_ratio(claim, one, other, statistic="t", alternative=alternative, runs_a_pair=1)
    assert found.estimate == one.mean() / other.mean()
    assert found.p == one_sided_p(one - other, 0.0, alternative)
    assert found.runs == 4
    assert (found.verdict == "reproduced") == is_met
