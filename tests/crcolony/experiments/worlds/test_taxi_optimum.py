"""The optimum by dynamic programming is that by counting steps."""

import numpy as np
import pytest

from crcolony.experiments.worlds.taxi import (
    IN_TAXI,
    RewardConvention,
    factors_of_states,
    start_states,
)
from crcolony.experiments.worlds.taxi_optimum import drive_by_table, optimal_values, transitions
from tests.support.oracles.taxi_distances import best_returns


@pytest.mark.parametrize("convention", RewardConvention)
def test_it_is_what_the_shortest_trips_earn(convention: RewardConvention) -> None:
    """V* of every start is 20, or 19, less the steps by breadth-first search on the map."""
    values = optimal_values(convention)
    cell, passenger, destination = (
        one[start_states(same_stand=True)] for one in factors_of_states()
    )
    assert (passenger != IN_TAXI).all()
    shortest = best_returns(convention.is_in_addition)[cell, passenger, destination]
    assert values[start_states(same_stand=True)].tolist() == shortest.tolist()


@pytest.mark.parametrize(
    ("convention", "same_stand", "mean", "least", "most"),
    [
        (RewardConvention.IN_PLACE, False, 7.93, 3.0, 15.0),
        (RewardConvention.IN_PLACE, True, 9.555, 3.0, 19.0),
        (RewardConvention.IN_ADDITION, False, 6.93, 2.0, 14.0),
        (RewardConvention.IN_ADDITION, True, 8.555, 2.0, 18.0),
    ],
)
def test_its_means_are_those_that_are_known(
    convention: RewardConvention, same_stand: bool, mean: float, least: float, most: float
) -> None:
    """Mean, least and most of V* over all starts, in both conventions."""
    values = optimal_values(convention)[start_states(same_stand)]
    assert (values.mean(), values.min(), values.max()) == (pytest.approx(mean), least, most)


def test_a_table_of_the_best_actions_earns_the_optimum() -> None:
    """Driven by Q* the taxi earns V* from every start; by no values at all it is lost."""
    convention = RewardConvention.IN_ADDITION
    state_next, rewards, ends = transitions(convention)
    values, starts = optimal_values(convention), start_states()
    q = np.where(ends, rewards, rewards + values[state_next])
    assert drive_by_table(q, starts, convention).tolist() == values[starts].tolist()
    assert drive_by_table(np.zeros_like(q), starts, convention).max() <= -100.0
