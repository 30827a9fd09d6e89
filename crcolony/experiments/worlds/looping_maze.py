"""A looping maze, and small round robots with two wheels and eight infrared sensors that drive in it (thesis 4.2).

The world of Floreano and Mondada, after the thesis' description: plan of the maze, sensors and contact with walls are
ours. The maze of a larger robot is the same one, scaled up.
"""

import math
from typing import NamedTuple

import numpy as np

from crcolony.compiled import FloatArray, compiled
from crcolony.randomness import Stream, draw

SENSORS = 8
ACTION_S = 0.3
"""A sensorimotor loop"""
_SUBSTEPS = 3
"""Steps of motion in it: a robot moves a third of its radius in one, at most"""
_PUSHES = 2
"""In a corner a robot is pushed off one wall, and then off the other"""
_NOISE = 0.05
"""Of a sensor, whose greatest activity is 1: uniform within plus and minus this"""
_SMALLEST = 1e-12

_OUTER = ((0, 0), (80, 0), (80, 50), (50, 50), (42, 40), (30, 40), (24, 50), (0, 50))
_ISLAND = ((14, 14), (66, 15), (65, 36), (55, 36), (47, 26), (26, 26), (18, 36), (14, 36))
_STARTS = ((7, 7), (40, 7), (73, 7), (73, 25), (72, 43), (36, 33), (8, 43), (7, 25))
"""All in cm, for the small robot"""
_CENTRE_CM = (40.0, 20.0)
"""In the island: a lap is a turn around it"""
_KHEPERA_ANGLES = (10, 45, 90, 170, -10, -45, -90, -170)
_KOALA_ANGLES = (6, 22, 50, 90, -6, -22, -50, -90)


class Body(NamedTuple):
    """A robot with wheels and sensors, and the maze that was made for it."""

    radius_m: float
    track_m: float
    wheel_speed_m_s: float
    """Of a wheel at full speed"""
    range_m: float
    """Of a sensor, from the rim of the body"""
    angles_rad: FloatArray
    """(SENSORS,) where the sensors are and look, left of the heading"""
    walls: FloatArray
    """(walls, 4) x and y of both ends, in m"""
    starts: FloatArray
    """(places, 2) in m"""
    centre: FloatArray
    """(2,) in m"""


class Situation(NamedTuple):
    """Where a robot is, and what it senses."""

    pose: FloatArray
    """(3,) x, y in m and heading in rad"""
    senses: FloatArray
    """(SENSORS,) 0: nothing in range; 1: touches"""


def khepera() -> Body:
    """Return a small robot: six of its sensors look ahead and to the sides, two behind."""
    return _body(0.0275, 0.053, 0.08, 0.05, _KHEPERA_ANGLES, 1.0)


def koala() -> Body:
    """Return a robot that is six times as large and five times as fast, all of whose sensors look ahead or aside."""
    return _body(0.165, 0.30, 0.4, 0.28, _KOALA_ANGLES, 6.0)


def _body(
    radius_m: float,
    track_m: float,
    wheel_speed_m_s: float,
    range_m: float,
    angles: tuple[int, ...],
    scale: float,
) -> Body:
    cm = 0.01 * scale
    walls = [
        (*one, *other)
        for ring in (_OUTER, _ISLAND)
        for one, other in zip(ring, (*ring[1:], ring[0]), strict=True)
    ]
    return Body(
        radius_m,
        track_m,
        wheel_speed_m_s,
        range_m,
        np.radians(np.array(angles, dtype=np.float64)),
        cm * np.array(walls, dtype=np.float64),
        cm * np.array(_STARTS, dtype=np.float64),
        cm * np.array(_CENTRE_CM),
    )


def new_situation() -> Situation:
    """Return the arrays of a robot."""
    return Situation(np.zeros(3), np.zeros(SENSORS))


@compiled
def start(body: Body, situation: Situation, stream: Stream) -> None:
    """Put the robot at one of the starts, in any direction, and let it sense."""
    place = int(draw(stream) * body.starts.shape[0])
    situation.pose[0] = body.starts[place, 0]
    situation.pose[1] = body.starts[place, 1]
    situation.pose[2] = 2.0 * math.pi * draw(stream)
    sense(body, situation, stream)


@compiled
def move(body: Body, situation: Situation, left: float, right: float, stream: Stream) -> bool:
    """Drive for a sensorimotor loop at wheel speeds from -1 to 1, and sense; return whether a wall was in the way."""
    pose = situation.pose
    period_s = ACTION_S / _SUBSTEPS
    speed_m_s = 0.5 * (left + right) * body.wheel_speed_m_s
    turn_rad_s = (right - left) * body.wheel_speed_m_s / body.track_m
    has_touched = False
    for _ in range(_SUBSTEPS):
        middle = pose[2] + 0.5 * turn_rad_s * period_s
        pose[0] += speed_m_s * period_s * math.cos(middle)
        pose[1] += speed_m_s * period_s * math.sin(middle)
        pose[2] += turn_rad_s * period_s
        for _ in range(_PUSHES):
            has_touched |= _push_off(body, pose)
    sense(body, situation, stream)
    return has_touched


@compiled
def _push_off(body: Body, pose: FloatArray) -> bool:
    """Push the robot off every wall that it is in, along which it so slides; return whether there was one."""
    is_in = False
    for k in range(body.walls.shape[0]):
        x, y = body.walls[k, 0], body.walls[k, 1]
        along_x, along_y = body.walls[k, 2] - x, body.walls[k, 3] - y
        part = (pose[0] - x) * along_x + (pose[1] - y) * along_y
        part = min(max(part / (along_x * along_x + along_y * along_y), 0.0), 1.0)
        off_x, off_y = pose[0] - x - part * along_x, pose[1] - y - part * along_y
        distance_m = math.sqrt(off_x * off_x + off_y * off_y)
        if distance_m < body.radius_m:
            is_in = True
            push = body.radius_m / max(distance_m, _SMALLEST) - 1.0
            pose[0] += push * off_x
            pose[1] += push * off_y
    return is_in


@compiled
def sense(body: Body, situation: Situation, stream: Stream) -> None:
    """Write what each sensor sees: the nearer the wall, the more, with noise."""
    pose = situation.pose
    for k in range(SENSORS):
        direction = pose[2] + body.angles_rad[k]
        distance_m = distance_to_wall(body, pose[0], pose[1], direction) - body.radius_m
        activity = 1.0 - distance_m / body.range_m + _NOISE * (2.0 * draw(stream) - 1.0)
        situation.senses[k] = min(max(activity, 0.0), 1.0)


@compiled
def distance_to_wall(body: Body, x: float, y: float, direction: float) -> float:
    """Return how far the nearest wall is from a point in a direction; infinity without one."""
    ray_x, ray_y = math.cos(direction), math.sin(direction)
    nearest_m = math.inf
    for k in range(body.walls.shape[0]):
        from_x, from_y = body.walls[k, 0] - x, body.walls[k, 1] - y
        along_x = body.walls[k, 2] - body.walls[k, 0]
        along_y = body.walls[k, 3] - body.walls[k, 1]
        across = ray_x * along_y - ray_y * along_x
        if abs(across) < _SMALLEST:
            continue
        distance_m = (from_x * along_y - from_y * along_x) / across
        part = (from_x * ray_y - from_y * ray_x) / across
        if distance_m >= 0.0 and 0.0 <= part <= 1.0:
            nearest_m = min(nearest_m, distance_m)
    return nearest_m


@compiled
def angle_around(body: Body, pose: FloatArray) -> float:
    """Return where on its lap a robot is, as an angle around the centre of the maze."""
    return math.atan2(pose[1] - body.centre[1], pose[0] - body.centre[0])
