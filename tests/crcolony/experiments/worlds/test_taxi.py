"""The taxi's world is Dietterich's: its map, rewards and known distances."""

import numpy as np
import pytest

from crcolony.experiments.worlds.taxi import (
    CELLS,
    DELIVERY,
    EAST,
    IN_TAXI,
    NORTH,
    PICKUP,
    PUTDOWN,
    SOUTH,
    STAND_CELLS,
    STATES,
    WEST,
    draw_start,
    encode,
    move,
    start_states,
    step,
)
from crcolony.randomness import new_streams
from tests.support.oracles.taxi_distances import stand_distances

R, G, Y, B = range(4)


def test_stands_are_as_far_apart_as_is_known() -> None:
    """R-G 8, R-Y 4, R-B 7, G-Y 8, G-B 5 and Y-B 7 steps."""
    distances = stand_distances()
    known = {(R, G): 8, (R, Y): 4, (R, B): 7, (G, Y): 8, (G, B): 5, (Y, B): 7}
    for (one, other), steps in known.items():
        assert distances[one, STAND_CELLS[other]] == steps
        assert distances[other, STAND_CELLS[one]] == steps


def test_walls_and_borders_stop_the_taxi() -> None:
    """There are 20 sides at the border and 6 at walls, on both sides of each: there a move leads nowhere."""
    still = [
        (cell, action)
        for cell in range(CELLS)
        for action in (NORTH, SOUTH, EAST, WEST)
        if move(cell, action) == cell
    ]
    assert len(still) == 20 + 2 * 6
    assert {(1, EAST), (2, WEST), (6, EAST), (7, WEST)} <= set(still)
    assert {(15, EAST), (20, EAST), (17, EAST), (22, EAST), (16, WEST), (23, WEST)} <= set(still)
    for cell in range(CELLS):
        for there, back in [(NORTH, SOUTH), (EAST, WEST)]:
            if move(cell, there) != cell:
                assert move(move(cell, there), back) == cell


@pytest.mark.parametrize(("in_addition", "extra"), [(False, 0.0), (True, 1.0)])
def test_rewards_come_in_place_of_the_cost_of_a_step_or_in_addition_to_it(
    in_addition: bool, extra: float
) -> None:
    """A step costs 1, delivery is worth 20 or 19, an illegal action costs 10 or 11 and changes nothing."""
    waiting, riding = encode(STAND_CELLS[R], R, B), encode(STAND_CELLS[R], IN_TAXI, B)
    arrived = encode(STAND_CELLS[B], IN_TAXI, B)
    assert step(waiting, SOUTH, in_addition) == (encode(5, R, B), -1.0, False)
    assert step(waiting, PICKUP, in_addition) == (riding, -1.0, False)
    assert step(riding, PICKUP, in_addition) == (riding, -10.0 - extra, False)
    assert step(waiting, PUTDOWN, in_addition) == (waiting, -10.0 - extra, False)
    assert step(riding, PUTDOWN, in_addition) == (riding, -10.0 - extra, False)
    delivered = encode(STAND_CELLS[B], B, B)
    assert step(arrived, PUTDOWN, in_addition) == (delivered, DELIVERY - extra, True)


def test_episodes_start_where_a_passenger_waits() -> None:
    """300 states, or 400 with those who are where they want to; all are drawn about as often."""
    assert start_states().size == 300
    assert start_states(same_stand=True).size == 400
    assert start_states(same_stand=True).max() < STATES
    starts, stream = start_states(), new_streams(1, (1,), 1)[0]
    drawn = np.array([draw_start(starts, stream) for _ in range(3000)])
    assert np.isin(drawn, starts).all()
    assert np.unique(drawn).size > 295
