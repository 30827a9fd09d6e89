"""Dietterich's taxi: bring a passenger from one of four stands to another on a grid of 5 x 5 (section 3.4.4).

A state is one number, of the taxi's cell (25), where the passenger is (a stand, or the taxi: 5) and the
destination (4). Moves are deterministic, into a wall they lead nowhere. A step costs 1, the right Putdown is
rewarded with 20 and ends the episode, and a Pickup or Putdown at a wrong place costs 10. Programs differ
in whether these two come in place of the cost of the step, as in Gymnasium, or in addition to it, as in the
thesis' example.
"""

from enum import Enum

import numpy as np

from crcolony.compiled import IntArray, compiled
from crcolony.randomness import Stream, draw

NORTH, SOUTH, EAST, WEST, PICKUP, PUTDOWN = range(6)
ACTION_NAMES = ("North", "South", "East", "West", "Pickup", "Putdown")
ACTIONS = 6
SIDE = 5
CELLS = 25
STANDS = 4
STAND_NAMES = "RGYB"
STAND_CELLS = (0, 4, 20, 23)
IN_TAXI = 4
"""Where the passenger is, when at no stand."""
STATES = CELLS * (STANDS + 1) * STANDS

STEP_COST = 1.0
DELIVERY = 20.0
ILLEGAL = -10.0
LONGEST_TRIP = 100
"""Steps after which a greedy taxi counts as lost; the longest of the best trips takes 18."""


class RewardConvention(Enum):
    """What the step costs in which the passenger is delivered, or an action is illegal."""

    IN_PLACE = "in place"
    """Nothing more: 20, and -10 (Gymnasium)"""
    IN_ADDITION = "in addition"
    """1, as every step: 19, and -11 (the thesis' example, eq. 3.16)"""

    @property
    def is_in_addition(self) -> bool:
        """Whether these steps cost 1, too."""
        return self is RewardConvention.IN_ADDITION


@compiled
def encode(cell: int, passenger: int, destination: int) -> int:
    """Return the number of a state."""
    return (cell * (STANDS + 1) + passenger) * STANDS + destination


@compiled
def cell_of(state: int) -> int:
    """Return the taxi's cell, 5 row + column, from the north-west corner."""
    return state // ((STANDS + 1) * STANDS)


@compiled
def passenger_of(state: int) -> int:
    """Return the stand at which the passenger waits, or IN_TAXI."""
    return state // STANDS % (STANDS + 1)


@compiled
def destination_of(state: int) -> int:
    """Return the stand to which the passenger wants."""
    return state % STANDS


@compiled
def move(cell: int, action: int) -> int:
    """Return the cell to which a move leads."""
    row, column = cell // SIDE, cell % SIDE
    if action == NORTH:
        return cell - SIDE if row > 0 else cell
    if action == SOUTH:
        return cell + SIDE if row < SIDE - 1 else cell
    west = column - 1 if action == WEST else column  # the column west of the border that is crossed
    if west < 0 or west >= SIDE - 1:
        return cell
    # walls: two cells long, from the north between columns 1 and 2, from the south behind 0 and 2
    if (west == 1 and row < 2) or ((west == 0 or west == 2) and row > 2):
        return cell
    return cell - 1 if action == WEST else cell + 1


@compiled
def step(state: int, action: int, step_cost_in_addition: bool) -> tuple[int, float, bool]:
    """Return the next state, the reward, and whether the episode has ended."""
    cell, passenger, destination = cell_of(state), passenger_of(state), destination_of(state)
    extra = STEP_COST if step_cost_in_addition else 0.0
    if action == PICKUP:
        if passenger != IN_TAXI and cell == STAND_CELLS[passenger]:
            return encode(cell, IN_TAXI, destination), -STEP_COST, False
        return state, ILLEGAL - extra, False
    if action == PUTDOWN:
        if passenger == IN_TAXI and cell == STAND_CELLS[destination]:
            return encode(cell, destination, destination), DELIVERY - extra, True
        return state, ILLEGAL - extra, False
    return encode(move(cell, action), passenger, destination), -STEP_COST, False


@compiled
def draw_start(starts: IntArray, stream: Stream) -> int:
    """Return one of these states, all equally likely."""
    return int(starts[min(int(draw(stream) * starts.shape[0]), starts.shape[0] - 1)])


def encode_uncompiled(cell: int, passenger: int, destination: int) -> int:
    """Return the same as `encode`, in plain Python: one call needs no compiler."""
    return (cell * (STANDS + 1) + passenger) * STANDS + destination


def factors_of_states() -> tuple[IntArray, IntArray, IntArray]:
    """Return the taxi's cell, where the passenger is, and the destination, of all states (states,)."""
    cell, passenger, destination = np.unravel_index(np.arange(STATES), (CELLS, STANDS + 1, STANDS))
    return cell, passenger, destination


def start_states(same_stand: bool = False) -> IntArray:
    """Return all states in which a passenger waits: 300, or 400 with those who want to where they are."""
    _, passenger, destination = factors_of_states()
    return np.flatnonzero((passenger != IN_TAXI) & (same_stand | (passenger != destination)))
