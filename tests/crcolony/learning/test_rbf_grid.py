"""The even grid of basis functions is the normalised RBF network of eq. 2.27, computed in another order."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crcolony.learning.features import NormalizedRBF
from crcolony.learning.rbf_grid import MOST_CENTRES, make_rbf_grid, rbf_grid_value

LOW, HIGH = np.array([-1.2, -0.07]), np.array([0.5, 0.07])


@given(
    counts=st.tuples(st.integers(2, MOST_CENTRES), st.integers(2, MOST_CENTRES)),
    x=st.floats(-30.0, 30.0),
    v=st.floats(-2.0, 2.0),
    seed=st.integers(0, 100),
)
def test_it_is_the_network_of_all_centres(
    counts: tuple[int, int], x: float, v: float, seed: int
) -> None:
    """At every state; far outside of the grid it is that at the border."""
    weights = np.random.default_rng(seed).normal(0.0, 100.0, counts[0] * counts[1])
    state = np.array([x, v])
    network = NormalizedRBF.grid(LOW, HIGH, np.array(counts))
    expected = float(np.dot(network(np.clip(state, LOW, HIGH))[1], weights))
    value = rbf_grid_value(make_rbf_grid(LOW, HIGH, counts), state, weights)
    assert value == pytest.approx(expected, rel=1e-9, abs=1e-7)


def test_a_constant_stays_one() -> None:
    """Responses are normalised: equal weights give their value everywhere."""
    grid = make_rbf_grid(LOW, HIGH, (5, 6))
    for state in np.random.default_rng(1).uniform(2 * LOW, 2 * HIGH, (100, 2)):
        assert rbf_grid_value(grid, state, np.full(30, 7.0)) == pytest.approx(7.0)


def test_an_empty_grid_is_refused() -> None:
    """There must be a range and two centres along each axis, and not too many."""
    for counts in ((1, 3), (3, MOST_CENTRES + 1)):
        with pytest.raises(ValueError, match="need 2 to 20 centres along an axis"):
            make_rbf_grid(LOW, HIGH, counts)
    with pytest.raises(ValueError, match="need low < high and a centre"):
        make_rbf_grid(HIGH, LOW, (3, 3))
