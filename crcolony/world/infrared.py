"""The infrared eyes: one range sensor ahead and seven proximity sensors around the front (thesis 4.6)."""

import math

from crcolony.body import contract
from crcolony.compiled import FloatArray, compiled
from crcolony.world.camera import wall_distance
from crcolony.world.state import World

_SENSORS = contract.PROXIMITY_SENSORS
_SPREAD_RAD = math.pi
"""The seven look from -90 to +90 degrees."""


@compiled
def ray(world: World, i: int, count: int, angle_rad: float, range_m: float) -> float:
    """Return how far from robot i's centre a ray at a bearing meets a surface, at most `range_m` (m)."""
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
            nearest, _disc(world.near[k, 1], world.near[k, 2], world.rules.radius_m, dx, dy)
        )
    for k in range(world.pillars.shape[0]):
        nearest = min(
            nearest,
            _disc(
                world.pillars[k, 0] - x,
                world.pillars[k, 1] - y,
                world.pillars[k, 2],
                dx,
                dy,
            ),
        )
    for k in range(world.walls.shape[0]):
        nearest = min(nearest, wall_distance(world.walls[k], x, y, dx, dy))
    return max(nearest, 0.0)


@compiled
def _disc(cx: float, cy: float, radius_m: float, dx: float, dy: float) -> float:
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
    """Write the range sensor and the seven proximity sensors, all measured from the hull, into an observation."""
    hull_m = world.rules.radius_m
    range_m = world.rules.ir_range_m
    row[contract.IR_RANGE] = max(ray(world, i, count, 0.0, hull_m + range_m) - hull_m, 0.0)
    reach_m = world.rules.proximity_range_m
    for k in range(_SENSORS):
        angle = _SPREAD_RAD * (k / (_SENSORS - 1) - 0.5)
        row[contract.PROXIMITY + k] = max(
            ray(world, i, count, angle, hull_m + reach_m) - hull_m, 0.0
        )
