"""A small robot drives, senses and is stopped in the maze, and a large one in a larger maze."""

import math

import numpy as np
import pytest

from crcolony.experiments.worlds.looping_maze import (
    Body,
    Situation,
    angle_around,
    distance_to_wall,
    khepera,
    koala,
    move,
    new_situation,
    sense,
    start,
)
from crcolony.randomness import Stream, new_streams

BODIES = {"khepera": khepera(), "koala": koala()}
SIZES = {"khepera": 1.0, "koala": 6.0}


def stream() -> Stream:
    found: Stream = new_streams(1, (1,), 1)[0]
    return found


def situated(x: float, y: float, heading: float) -> Situation:
    """Return a robot at a place in the small maze, in m."""
    situation = new_situation()
    situation.pose[:] = x, y, heading
    return situation


def test_wheels_that_turn_alike_drive_straight_on_and_against_each_other_turn_on_the_spot() -> None:
    """At 80 mm/s with full speed, for the three tenths of a second of a sensorimotor loop."""
    ahead, back, turning = (situated(0.4, 0.07, 0.0) for _ in range(3))
    assert not move(khepera(), ahead, 1.0, 1.0, stream())
    assert not move(khepera(), back, -0.5, -0.5, stream())
    assert not move(khepera(), turning, -0.1, 0.1, stream())
    assert ahead.pose.round(6).tolist() == [0.424, 0.07, 0.0]
    assert back.pose.round(6).tolist() == [0.388, 0.07, 0.0]
    assert turning.pose.round(6).tolist() == [0.4, 0.07, round(2 * 0.008 * 0.3 / 0.053, 6)]


def test_a_wall_stops_a_robot_that_drives_at_it_and_lets_one_slide_along_it() -> None:
    """It is pushed back as far as its rim was in the wall; both are contacts."""
    against, along = situated(0.4, 0.03, -math.pi / 2), situated(0.4, 0.0275, -math.pi / 6)
    assert move(khepera(), against, 1.0, 1.0, stream())
    assert move(khepera(), along, 1.0, 1.0, stream())
    assert against.pose[:2].round(6).tolist() == [0.4, 0.0275]
    assert along.pose[:2].round(6).tolist() == [
        round(0.4 + 0.024 * math.cos(math.pi / 6), 6),
        0.0275,
    ]


def test_in_a_corner_a_robot_stays_off_both_walls() -> None:
    """However long it drives into it."""
    situation = situated(0.05, 0.05, -3 * math.pi / 4)
    for _ in range(20):
        move(khepera(), situation, 1.0, 1.0, stream())
    assert situation.pose[:2].round(6).tolist() == [0.0275, 0.0275]


def test_a_sensor_sees_more_of_a_wall_that_is_nearer_and_nothing_beyond_its_range() -> None:
    """Half of it from the middle of its range, within the noise."""
    body, near = khepera(), situated(0.4, 0.0275 + 0.025, 0.0)
    draws = np.zeros((200, 8))
    random = stream()
    for row in draws:
        sense(body, near, random)
        row[:] = near.senses
    left, right = body.angles_rad.argsort()[[-2, 1]].tolist()
    assert body.angles_rad[[left, right]].round(4).tolist() == [1.5708, -1.5708]
    assert draws[:, right].mean() == pytest.approx(0.5, abs=0.01)
    assert 0.44 < draws[:, right].min() < 0.46
    assert 0.54 < draws[:, right].max() < 0.56
    assert draws[:, left].max() <= 0.05


def test_distances_to_walls_are_those_of_the_plan() -> None:
    """In the four directions from the lower corridor, and nowhere through a wall."""
    body = khepera()
    directions = (0.0, math.pi / 2, math.pi, -math.pi / 2)
    found = [distance_to_wall(body, 0.2, 0.05, one) for one in directions]
    island = 0.14 + 0.01 * (0.2 - 0.14) / 0.52 - 0.05
    assert found == pytest.approx([0.6, island, 0.2, 0.05])


@pytest.mark.parametrize("name", BODIES)
def test_every_start_is_free_in_every_maze(name: str) -> None:
    """A robot that has just begun touches no wall, wherever it is put; it is put everywhere."""
    body, random, situation = BODIES[name], stream(), new_situation()
    places = set()
    for _ in range(100):
        start(body, situation, random)
        places.add(tuple(situation.pose[:2].tolist()))
        assert not move(body, situation, 0.0, 0.0, random)
    assert len(places) == len(body.starts)


def test_the_large_maze_is_the_small_one_for_a_robot_that_is_as_much_larger() -> None:
    """Walls and starts are scaled with the radius; where the sensors are is another matter."""
    small, large = khepera(), koala()
    for name in ("walls", "starts", "centre"):
        assert np.allclose(getattr(large, name), SIZES["koala"] * getattr(small, name))
    assert large.radius_m == pytest.approx(SIZES["koala"] * small.radius_m)
    assert not np.allclose(large.angles_rad, small.angles_rad)


def test_a_lap_is_a_turn_around_the_centre() -> None:
    """The starts but one in the middle are in the order of such a turn."""
    body: Body = khepera()
    angles = [angle_around(body, np.array([*place, 0.0])) for place in body.starts]
    steps = np.diff(np.unwrap([*angles, angles[0]]))
    assert (steps > 0.0).all()
    assert steps.sum() == pytest.approx(2.0 * math.pi)
