"""A share of runs is measured with its exact interval, against one half."""

import msgspec
import numpy as np
import pytest

from crcolony.compiled import BoolArray
from crcolony.experiments.framework.measured_share import measured_share, share_interval
from crcolony.experiments.framework.registration import parse_registration
from tests.support.fake_experiment import REGISTRATION

(CLAIM,) = parse_registration(REGISTRATION).claims


def runs(successes: int, size: int) -> BoolArray:
    return np.arange(size) < successes


def test_the_interval_is_that_of_clopper_and_pearson() -> None:
    """All of ten runs: the lower end is the tenth root of 0.025."""
    found = share_interval(runs(10, 10))
    assert (found.estimate, found.high) == (1.0, 1.0)
    assert found.low == pytest.approx(0.025**0.1)


@pytest.mark.parametrize(
    ("successes", "verdict"), [(20, "reproduced"), (16, "partly"), (11, "not"), (0, "not")]
)
def test_it_holds_where_the_share_reaches_the_threshold_and_is_more_than_half(
    successes: int, verdict: str
) -> None:
    """The binomial test alone makes it hold in part."""
    claim = msgspec.structs.replace(CLAIM, threshold=0.9)
    found = measured_share(claim, runs(successes, 20))
    assert found.verdict == verdict
    assert found.runs == 20
    assert found.statistic.startswith(f"{successes} of 20 runs;")
