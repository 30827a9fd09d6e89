"""The infrared sensors (thesis 4.6): a range sensor ahead and seven proximity sensors."""

import math

import numpy as np

from crcolony.body import contract
from crcolony.compiled import FloatArray, compiled
from crcolony.world.camera import wall_crossing
from crcolony.world.state import World

_SPREAD_RAD = math.pi
"""The proximity sensors point from -90 to +90 degrees."""
_BEARINGS_RAD = [
    _SPREAD_RAD * (k / (contract.PROXIMITY_SENSORS - 1) - 0.5)
    for k in range(contract.PROXIMITY_SENSORS)
]
_DIRECTIONS = np.array([(math.cos(bearing), math.sin(bearing)) for bearing in _BEARINGS_RAD])
"""(sensors, 2) where the proximity sensors point to: ahead and to the left."""


@compiled
def sense_infrared(world: World, i: int, count: int, row: FloatArray) -> None:
    """Write the range sensor and the proximity sensors, measured from the hull, to an observation
    (row).

    `world.near_bodies` has the `count` bodies around robot i.
    """
    rules = world.rules
    hull_m = rules.radius_m
    reach_m = hull_m + rules.ir_range_m
    close = _collect_close(world, i, count, reach_m)
    row[contract.IR_RANGE] = max(_cast_ray(world, i, close, 1.0, 0.0, reach_m) - hull_m, 0.0)
    reach_m = hull_m + rules.proximity_range_m
    close = _collect_close(world, i, count, reach_m)
    for k in range(contract.PROXIMITY_SENSORS):
        distance_m = _cast_ray(world, i, close, _DIRECTIONS[k, 0], _DIRECTIONS[k, 1], reach_m)
        row[contract.PROXIMITY + k] = max(distance_m - hull_m, 0.0)


@compiled
def _collect_close(world: World, i: int, count: int, reach_m: float) -> int:
    """Write the bodies that a ray of robot i may hit within `reach_m` to `world.close_bodies`, as
    the robot sees them; return how many."""
    cosine, sine = world.headings[i, 0], world.headings[i, 1]
    furthest_m = reach_m + world.rules.radius_m
    close = 0
    for k in range(count):
        dx, dy = world.near_bodies[k, 1], world.near_bodies[k, 2]
        ahead_m = dx * cosine + dy * sine
        world.close_bodies[close, 0] = ahead_m
        world.close_bodies[close, 1] = dy * cosine - dx * sine
        may_be_hit = (world.near_bodies[k, 3] <= furthest_m * furthest_m) & (ahead_m > -furthest_m)
        close += 1 if may_be_hit else 0
    return close


@compiled
def _cast_ray(world: World, i: int, close: int, ahead: float, left: float, reach_m: float) -> float:
    """Return how far from robot i's centre a ray hits a surface (m), at most `reach_m`.

    `ahead` and `left` are its direction, of length 1, as the robot sees it. `world.close_bodies`
    has the `close` bodies that it may hit.
    """
    nearest = reach_m
    for k in range(close):
        distance_m = _disc_distance_m(
            world.close_bodies[k, 0], world.close_bodies[k, 1], world.rules.radius_m, ahead, left
        )
        nearest = min(nearest, distance_m)
    x, y = world.poses[i, 0], world.poses[i, 1]
    dx = world.headings[i, 0] * ahead - world.headings[i, 1] * left
    dy = world.headings[i, 1] * ahead + world.headings[i, 0] * left
    half_x, half_y = 0.5 * world.rules.width_m, 0.5 * world.rules.height_m
    if abs(x) + reach_m > half_x and dx != 0.0:
        nearest = min(nearest, (math.copysign(half_x, dx) - x) / dx)
    if abs(y) + reach_m > half_y and dy != 0.0:
        nearest = min(nearest, (math.copysign(half_y, dy) - y) / dy)
    for k in range(world.pillars.shape[0]):
        cx, cy = world.pillars[k, 0] - x, world.pillars[k, 1] - y
        nearest = min(nearest, _disc_distance_m(cx, cy, world.pillars[k, 2], dx, dy))
    for k in range(world.walls.shape[0]):
        nearest = min(nearest, wall_crossing(world.walls[k], x, y, dx, dy))
    return max(nearest, 0.0)


@compiled
def _disc_distance_m(cx: float, cy: float, radius_m: float, dx: float, dy: float) -> float:
    """Return how far a ray from the origin in direction dx, dy (of length 1) hits a disc at cx, cy,
    or inf."""
    along = cx * dx + cy * dy
    if along <= 0.0:
        return math.inf
    beside = cx * dy - cy * dx
    under = radius_m * radius_m - beside * beside
    if under < 0.0:
        return math.inf
    return along - math.sqrt(under)
