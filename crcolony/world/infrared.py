"""The infrared sensors (thesis 4.6): a range sensor ahead and seven proximity sensors."""

import math

from crcolony.body import contract
from crcolony.compiled import FloatArray, compiled
from crcolony.world.camera import wall_crossing
from crcolony.world.state import World

_SPREAD_RAD = math.pi
"""The proximity sensors point from -90 to +90 degrees."""


@compiled
def cast_ray(world: World, i: int, count: int, angle_rad: float, range_m: float) -> float:
    """Return how far from robot i's centre a ray at a bearing hits a surface (m), at most
    `range_m`.

    `world.near_bodies` has the `count` bodies around the robot.
    """
    x, y = world.poses[i, 0], world.poses[i, 1]
    dx = math.cos(world.poses[i, 2] + angle_rad)
    dy = math.sin(world.poses[i, 2] + angle_rad)
    nearest = range_m
    half_x, half_y = 0.5 * world.rules.width_m, 0.5 * world.rules.height_m
    if dx != 0.0:
        nearest = min(nearest, (math.copysign(half_x, dx) - x) / dx)
    if dy != 0.0:
        nearest = min(nearest, (math.copysign(half_y, dy) - y) / dy)
    for k in range(count):
        nearest = min(
            nearest,
            _disc_distance_m(
                world.near_bodies[k, 1], world.near_bodies[k, 2], world.rules.radius_m, dx, dy
            ),
        )
    for k in range(world.pillars.shape[0]):
        nearest = min(
            nearest,
            _disc_distance_m(
                world.pillars[k, 0] - x,
                world.pillars[k, 1] - y,
                world.pillars[k, 2],
                dx,
                dy,
            ),
        )
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


@compiled
def sense_infrared(world: World, i: int, count: int, row: FloatArray) -> None:
    """Write the range sensor and the proximity sensors, measured from the hull, to an observation
    (row).

    `world.near_bodies` has the `count` bodies around robot i.
    """
    hull_m = world.rules.radius_m
    range_m = world.rules.ir_range_m
    row[contract.IR_RANGE] = max(cast_ray(world, i, count, 0.0, hull_m + range_m) - hull_m, 0.0)
    reach_m = world.rules.proximity_range_m
    for k in range(contract.PROXIMITY_SENSORS):
        angle = _SPREAD_RAD * (k / (contract.PROXIMITY_SENSORS - 1) - 0.5)
        row[contract.PROXIMITY + k] = max(
            cast_ray(world, i, count, angle, hull_m + reach_m) - hull_m, 0.0
        )
