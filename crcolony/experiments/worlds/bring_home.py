"""Find a battery pack and bring it to the nest (the task of Paper V), in a coarse world of our own.

A robot is a point that drives one unit of length, or turns, in a step. Its camera sees pack and nest within a range and
an angle; walls are low, so that it sees over them, but cannot drive through. The jaw closes by itself at the pack, and
opens at the nest. What a learner gets to know is one of `states(...)` observations: bearings and distances are coarse.
"""

import math
from typing import NamedTuple

import numpy as np

from crcolony.compiled import FloatArray, compiled
from crcolony.randomness import Stream, draw

WANDER, ROTATE, FOLLOW_LEFT, FOLLOW_RIGHT, TO_PACK, TO_NEST = range(6)
"""The primitive subtasks; each ends after one step."""

X, Y, HEADING, PACK_X, PACK_Y, CARRYING = range(6)
"""Elements of a `Place`."""
Place = FloatArray
"""(6,) where the robot is and where it heads (radians), where the pack is, and whether it is carried (1.0 or 0.0)."""

STEP = 1.0
TURN = math.pi / 4.0
"""What it turns in a step at most."""
REACH = 1.0
"""The jaw closes and opens at this distance."""
FEEL = 1.2
"""Range of the proximity sensors: ahead, and at right angles to the left and right."""
NEAR = 3.0
"""What is seen from so near is seen to be near."""
STRAIGHT = math.pi / 8.0
"""What is seen at a smaller bearing is seen ahead, else to the left or right."""

SIGHTS = 7
"""Unseen, or seen to the right, ahead or to the left: from near, 1 to 3, or from far, 4 to 6."""
AHEAD, LEFT, RIGHT = 1, 2, 4
"""Bits of the three proximity sensors."""
OBSTACLES = 8


class World(NamedTuple):
    """An environment: a square with low walls, a nest, and an area in which packs appear. Units of length: a step."""

    walls: FloatArray
    """(walls, 4) from x, y to x, y, each along an axis; the outer ones too"""
    nest: FloatArray
    """(2,) x, y"""
    pack_area: FloatArray
    """(4,) least x, y and most x, y"""
    view_range: float
    view_angle: float
    """Radians to either side"""
    cue: int
    """What a sensor says about the setting of the world, if robots have one; else 0"""


def new_world(
    size: float,
    nest: tuple[float, float],
    pack_area: tuple[float, float, float, float],
    view: tuple[float, float],
    walls: tuple[tuple[float, float, float, float], ...] = (),
    cue: int = 0,
) -> World:
    """Return a world in a square from 0, 0 to size, size; `view` is range and angle to either side (radians)."""
    outer = (
        (0.0, 0.0, size, 0.0),
        (0.0, size, size, size),
        (0.0, 0.0, 0.0, size),
        (size, 0.0, size, size),
    )
    return World(
        walls=np.array([*outer, *walls]),
        nest=np.array(nest),
        pack_area=np.array(pack_area),
        view_range=view[0],
        view_angle=view[1],
        cue=cue,
    )


def states(cues: int) -> int:
    """Return the number of observations where a sensor tells so many settings apart."""
    return cues * 2 * SIGHTS * SIGHTS * OBSTACLES


@compiled
def place_at_nest(world: World, place: Place, stream: Stream) -> None:
    """Put the robot into the nest, heading anywhere, and a pack anywhere in its area."""
    area = world.pack_area
    place[X], place[Y] = world.nest[0], world.nest[1]
    place[HEADING] = 2.0 * math.pi * draw(stream)
    place[PACK_X] = area[0] + (area[2] - area[0]) * draw(stream)
    place[PACK_Y] = area[1] + (area[3] - area[1]) * draw(stream)
    place[CARRYING] = 0.0


@compiled
def act(world: World, place: Place, action: int, stream: Stream) -> bool:
    """Execute a primitive subtask for a step; return whether the pack has come home by it."""
    if action == ROTATE:
        place[HEADING] += TURN
    else:
        if action == WANDER:
            _wander(world, place, stream)
        elif action == FOLLOW_LEFT:
            _follow(world, place, 1.0)
        elif action == FOLLOW_RIGHT:
            _follow(world, place, -1.0)
        elif action == TO_PACK:
            _face(world, place, place[PACK_X], place[PACK_Y])
        else:
            _face(world, place, world.nest[0], world.nest[1])
        _drive(world, place)
    if place[CARRYING] == 0.0:
        if math.hypot(place[PACK_X] - place[X], place[PACK_Y] - place[Y]) <= REACH:
            place[CARRYING] = 1.0
        return False
    return math.hypot(world.nest[0] - place[X], world.nest[1] - place[Y]) <= REACH


@compiled
def observe(world: World, place: Place) -> int:
    """Return the observation: the cue, whether it carries, how it sees pack and nest, and what it feels.

    A pack that it carries is not seen.
    """
    carrying = int(place[CARRYING])
    pack = 0 if carrying else _sight(world, place, place[PACK_X], place[PACK_Y])
    nest = _sight(world, place, world.nest[0], world.nest[1])
    view = ((world.cue * 2 + carrying) * SIGHTS + pack) * SIGHTS + nest
    return view * OBSTACLES + _feel(world, place)


@compiled
def _wander(world: World, place: Place, stream: Stream) -> None:
    """Turn a little at random; before a wall far, to either side."""
    if _is_blocked(world, place, place[HEADING], FEEL):
        place[HEADING] += math.pi * (0.5 + draw(stream))
    else:
        place[HEADING] += TURN * (draw(stream) - 0.5)


@compiled
def _follow(world: World, place: Place, side: float) -> None:
    """Keep a wall at the left (side 1.0) or right (-1.0), turn away from one ahead; where none is go straight."""
    felt = _feel(world, place)
    is_beside = felt & (LEFT if side > 0.0 else RIGHT)
    if not is_beside and not felt & AHEAD:
        return
    for eighth in range(1 if is_beside else -1, -5, -1):
        heading = place[HEADING] + side * eighth * TURN
        if not _is_blocked(world, place, heading, FEEL):
            place[HEADING] = heading
            return


@compiled
def _face(world: World, place: Place, x: float, y: float) -> None:
    """Turn towards what is in sight, by TURN at most."""
    if _sight(world, place, x, y) > 0:
        place[HEADING] += min(max(_bearing(place, x, y), -TURN), TURN)


@compiled
def _drive(world: World, place: Place) -> None:
    """Drive a step, unless a wall is in the way: then stay."""
    if not _is_blocked(world, place, place[HEADING], STEP):
        place[X] += STEP * math.cos(place[HEADING])
        place[Y] += STEP * math.sin(place[HEADING])


@compiled
def _feel(world: World, place: Place) -> int:
    """Return what the proximity sensors feel, see OBSTACLES."""
    heading = place[HEADING]
    felt = AHEAD if _is_blocked(world, place, heading, FEEL) else 0
    felt += LEFT if _is_blocked(world, place, heading + math.pi / 2.0, FEEL) else 0
    felt += RIGHT if _is_blocked(world, place, heading - math.pi / 2.0, FEEL) else 0
    return felt


@compiled
def _sight(world: World, place: Place, x: float, y: float) -> int:
    """Return how a point is seen, see SIGHTS."""
    distance = math.hypot(x - place[X], y - place[Y])
    bearing = _bearing(place, x, y)
    if distance > world.view_range or abs(bearing) > world.view_angle:
        return 0
    side = 1 if bearing < -STRAIGHT else 3 if bearing > STRAIGHT else 2
    return side if distance <= NEAR else side + 3


@compiled
def _bearing(place: Place, x: float, y: float) -> float:
    """Return at which angle a point is, radians from -pi to pi, to the left above 0."""
    angle = math.atan2(y - place[Y], x - place[X]) - float(place[HEADING])
    return angle - 2.0 * math.pi * math.floor(angle / (2.0 * math.pi) + 0.5)


@compiled
def _is_blocked(world: World, place: Place, heading: float, distance: float) -> bool:
    """Return whether a wall is crossed on the way from the robot's place in a direction."""
    x, y = place[X], place[Y]
    to_x, to_y = x + distance * math.cos(heading), y + distance * math.sin(heading)
    for wall in range(world.walls.shape[0]):
        x0, y0 = world.walls[wall, 0], world.walls[wall, 1]
        x1, y1 = world.walls[wall, 2], world.walls[wall, 3]
        if x0 == x1:
            if (x - x0) * (to_x - x0) <= 0.0 and x != to_x:
                crossing = y + (to_y - y) * (x0 - x) / (to_x - x)
                if y0 <= crossing <= y1:
                    return True
        elif (y - y0) * (to_y - y0) <= 0.0 and y != to_y:
            crossing = x + (to_x - x) * (y0 - y) / (to_y - y)
            if x0 <= crossing <= x1:
                return True
    return False
