"""A comparison of two conditions is described by its interval, its effect size and its runs."""

import math

import numpy as np

from crcolony.experiments.framework.measured_pairs import measured_pairs
from crcolony.experiments.framework.statistics import Interval


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
