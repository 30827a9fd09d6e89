"""The world in which packs are brought home: what primitives do and what is observed, by hand."""

import math

import numpy as np
import pytest

from crcolony.experiments.worlds.bring_home import (
    AHEAD,
    CARRYING,
    FOLLOW_LEFT,
    FOLLOW_RIGHT,
    HEADING,
    LEFT,
    OBSTACLES,
    RIGHT,
    ROTATE,
    SIGHTS,
    TO_NEST,
    TO_PACK,
    TURN,
    WANDER,
    Place,
    World,
    X,
    Y,
    act,
    new_world,
    observe,
    place_at_nest,
    states,
)
from crcolony.randomness import Stream, new_streams

UP = math.pi / 2.0
WALL = (3.0, 6.0, 9.0, 6.0)
WORLD = new_world(12.0, (6.0, 2.0), (3.0, 8.0, 9.0, 11.0), (8.0, math.pi / 2.0), (WALL,))


def placed(x: float, y: float, heading: float, pack: tuple[float, float], carrying: float) -> Place:
    """Return a place."""
    return np.array([x, y, heading, *pack, carrying])


def factors(world: World, place: Place, cues: int = 1) -> tuple[int, ...]:
    """Return cue, carrying, pack, nest and obstacles of an observation."""
    shape = (cues, 2, SIGHTS, SIGHTS, OBSTACLES)
    return tuple(map(int, np.unravel_index(observe(world, place), shape)))


def stream() -> Stream:
    """Return a stream of random numbers."""
    drawn: Stream = new_streams(1, (1,), 1)[0]
    return drawn


@pytest.mark.parametrize(
    ("pack", "sight"),
    [
        ((6.0, 10.0), 5),
        ((6.0, 5.5), 2),
        ((4.5, 5.0), 3),
        ((7.5, 5.0), 1),
        ((2.0, 6.0), 6),
        ((10.0, 6.0), 4),
        ((6.0, 2.0), 0),
        ((6.0, 11.1), 0),
    ],
)
def test_a_pack_is_seen_by_bearing_and_distance(pack: tuple[float, float], sight: int) -> None:
    """Right, ahead, left: 1 to 3 near, 4 to 6 far; over walls; not behind nor beyond the range of 8."""
    place = placed(6.0, 3.0, UP, pack, 0.0)
    assert factors(WORLD, place)[2] == sight
    assert factors(WORLD, place)[1] == 0


def test_a_pack_that_is_carried_is_not_seen_and_the_nest_is() -> None:
    """The cue is the world's."""
    place = placed(6.0, 5.0, -UP, (6.0, 5.0), 1.0)
    assert factors(WORLD._replace(cue=1), place, 2) == (1, 1, 0, 2, 0)
    assert observe(WORLD._replace(cue=1), place) < states(2)


@pytest.mark.parametrize(
    ("x", "y", "heading", "felt"),
    [
        (6.0, 4.0, UP, 0),
        (6.0, 5.0, UP, AHEAD),
        (6.0, 5.0, 0.0, LEFT),
        (6.0, 5.0, math.pi, RIGHT),
        (1.0, 11.0, UP, AHEAD | LEFT),
        (11.0, 11.0, UP, AHEAD | RIGHT),
        (10.5, 5.0, UP, 0),
    ],
)
def test_walls_are_felt_ahead_and_at_the_sides(
    x: float, y: float, heading: float, felt: int
) -> None:
    """Inner and outer ones, within 1.2 steps."""
    assert factors(WORLD, placed(x, y, heading, (6.0, 10.0), 0.0))[4] == felt


def test_primitives_drive_and_turn_for_a_step() -> None:
    """To what is in sight, by 45 degrees at most; a wall in the way stops them."""
    place = placed(6.0, 3.0, UP, (6.0, 10.0), 0.0)
    act(WORLD, place, ROTATE, stream())
    assert place[:3] == pytest.approx([6.0, 3.0, UP + TURN])
    act(WORLD, place, TO_PACK, stream())
    assert place[:3] == pytest.approx([6.0, 4.0, UP])
    act(WORLD, place, TO_PACK, stream())
    act(WORLD, place, TO_PACK, stream())
    assert place[:3] == pytest.approx([6.0, 5.0, UP]), "the wall is at 6"
    place = placed(6.0, 4.9, 0.0, (0.0, 0.0), 1.0)
    act(WORLD, place, TO_NEST, stream())
    assert place[HEADING] == pytest.approx(-TURN)


@pytest.mark.parametrize(("action", "direction"), [(FOLLOW_LEFT, 1.0), (FOLLOW_RIGHT, -1.0)])
def test_a_wall_is_followed_to_its_end(action: int, direction: float) -> None:
    """With the wall at the left one gets past its right end, and the other way round."""
    place = placed(6.0, 5.0, UP, (6.0, 10.0), 0.0)
    for _ in range(6):
        act(WORLD, place, action, stream())
    assert (place[X] - 6.0) * direction > 3.0
    assert place[Y] == pytest.approx(5.0, abs=1.0)


def test_wandering_never_leaves_the_square() -> None:
    """Nor crosses the wall between two of its steps."""
    place, draws = placed(6.0, 3.0, UP, (-9.0, -9.0), 0.0), stream()
    for _ in range(500):
        before = place.copy()
        act(WORLD, place, WANDER, draws)
        assert 0.0 <= place[X] <= 12.0
        assert 0.0 <= place[Y] <= 12.0
        if (before[Y] - 6.0) * (place[Y] - 6.0) < 0.0:
            share = (6.0 - before[Y]) / (place[Y] - before[Y])
            assert not WALL[0] <= before[X] + share * (place[X] - before[X]) <= WALL[2]


def test_a_pack_is_captured_and_comes_home() -> None:
    """The jaw closes within a step of the pack; it is home only if it is carried."""
    place, draws = placed(6.0, 3.0, UP, (6.0, 4.8), 0.0), stream()
    assert not act(WORLD, place, TO_PACK, draws)
    assert place[CARRYING] == 1.0
    place[HEADING] = -UP
    assert act(WORLD, place, TO_NEST, draws)
    empty = placed(6.0, 3.0, -UP, (6.0, 10.0), 0.0)
    assert not act(WORLD, empty, TO_NEST, draws)


def test_a_trip_begins_in_the_nest() -> None:
    """With a pack in its area, and the same ones for the same stream."""
    places = []
    for _ in range(2):
        draws, place = stream(), np.zeros(6)
        for _ in range(50):
            place_at_nest(WORLD, place, draws)
            assert (place[X], place[Y], place[CARRYING]) == (6.0, 2.0, 0.0)
            assert 3.0 <= place[3] <= 9.0
            assert 8.0 <= place[4] <= 11.0
        places.append(place.copy())
    np.testing.assert_array_equal(places[0], places[1])
