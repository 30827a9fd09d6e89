"""The camera (thesis 4.6): battery packs, faces and tail lamps with distance and bearing."""

import math

from crcolony.body import contract
from crcolony.compiled import FloatArray, compiled
from crcolony.world.neighbours import collect_near
from crcolony.world.state import World


@compiled
def is_hidden(
    world: World, count: int, x: float, y: float, dx: float, dy: float, target: int
) -> bool:
    """Return whether something stands between a robot at x, y and the point dx, dy (m) away from
    it.

    `world.near_bodies` has the `count` bodies around the robot. The body `target` (or -1) hides
    nothing, and neither does the robot itself, because the line of sight starts at its centre.
    """
    squared_m2 = dx * dx + dy * dy
    radius_m = world.rules.radius_m
    for k in range(count):
        if int(world.near_bodies[k, 0]) != target and _crosses(
            world.near_bodies[k, 1], world.near_bodies[k, 2], radius_m, dx, dy, squared_m2
        ):
            return True
    for k in range(world.pillars.shape[0]):
        if _crosses(
            world.pillars[k, 0] - x,
            world.pillars[k, 1] - y,
            world.pillars[k, 2],
            dx,
            dy,
            squared_m2,
        ):
            return True
    for k in range(world.walls.shape[0]):
        if wall_crossing(world.walls[k], x, y, dx, dy) < 1.0:
            return True
    return False


@compiled
def _crosses(
    cx: float, cy: float, radius_m: float, dx: float, dy: float, squared_m2: float
) -> bool:
    """Return whether a line from the origin to dx, dy (m) crosses a disc at cx, cy."""
    along = cx * dx + cy * dy
    if along <= 0.0:
        return False
    share = min(along / squared_m2, 1.0)
    away_x = cx - share * dx
    away_y = cy - share * dy
    return away_x * away_x + away_y * away_y < radius_m * radius_m


@compiled
def wall_crossing(wall: FloatArray, x: float, y: float, dx: float, dy: float) -> float:
    """Return the share of the line dx, dy from x, y (m) at which it crosses a wall, or inf.

    `wall` is (4,): x1, y1, x2, y2 (m).
    """
    wall_x = wall[2] - wall[0]
    wall_y = wall[3] - wall[1]
    across = dx * wall_y - dy * wall_x
    if across == 0.0:
        return math.inf
    to_x = wall[0] - x
    to_y = wall[1] - y
    share: float = (to_x * wall_y - to_y * wall_x) / across
    wall_share = (to_x * dy - to_y * dx) / across
    if share < 0.0 or wall_share < 0.0 or wall_share > 1.0:
        return math.inf
    return share


@compiled
def is_in_view(ahead_m: float, squared_m2: float, cosine: float) -> bool:
    """Return whether a point, `ahead_m` along the heading, lies within an angle given by its
    cosine."""
    return ahead_m * abs(ahead_m) >= cosine * abs(cosine) * squared_m2


@compiled
def _write_blob(
    row: FloatArray, blob: int, distance_m: float, ahead_m: float, left_m: float
) -> None:
    row[blob] = 1.0
    row[blob + contract.DISTANCE] = distance_m
    row[blob + contract.BEARING] = math.atan2(left_m, ahead_m)


@compiled
def sense_robots(world: World, i: int, count: int, row: FloatArray) -> None:
    """Write the nearest visible face and tail lamp to an observation (row).

    `world.near_bodies` has the `count` bodies around robot i.
    """
    cosine, sine = world.headings[i, 0], world.headings[i, 1]
    nearest_face, nearest_tail = math.inf, math.inf
    for k in range(count):
        dx, dy, squared_m2 = (
            world.near_bodies[k, 1],
            world.near_bodies[k, 2],
            world.near_bodies[k, 3],
        )
        ahead_m = dx * cosine + dy * sine
        other = int(world.near_bodies[k, 0])
        if other == i or not is_in_view(ahead_m, squared_m2, world.rules.camera_cosine):
            continue
        is_face = dx * world.headings[other, 0] + dy * world.headings[other, 1] <= 0.0
        if squared_m2 >= (nearest_face if is_face else nearest_tail):
            continue
        if world.rules.occlusion and is_hidden(
            world, count, world.poses[i, 0], world.poses[i, 1], dx, dy, other
        ):
            continue
        blob = contract.FACE if is_face else contract.TAIL
        _write_blob(row, blob, math.sqrt(squared_m2), ahead_m, dy * cosine - dx * sine)
        if is_face:
            nearest_face = squared_m2
            for c in range(3):
                row[contract.FACE + contract.COLOUR + c] = world.actions[other, contract.LED + c]
        else:
            nearest_tail = squared_m2
            row[contract.TAIL + contract.COLOUR] = 1.0


@compiled
def sense_packs(world: World, i: int, count: int, row: FloatArray) -> None:
    """Write the nearest visible battery pack that no jaw holds to an observation (row).

    `world.near_bodies` has the `count` bodies around robot i, which may hide packs.
    """
    x, y = world.poses[i, 0], world.poses[i, 1]
    cosine, sine = world.headings[i, 0], world.headings[i, 1]
    found = collect_near(
        world.pack_cells, world.packs, x, y, world.rules.camera_range_m, world.near_packs
    )
    nearest = math.inf
    for k in range(found):
        pack = int(world.near_packs[k, 0])
        dx, dy, squared_m2 = world.near_packs[k, 1], world.near_packs[k, 2], world.near_packs[k, 3]
        if squared_m2 >= nearest or world.pack_holders[pack] >= 0:
            continue
        ahead_m = dx * cosine + dy * sine
        if not is_in_view(ahead_m, squared_m2, world.rules.camera_cosine):
            continue
        if world.rules.occlusion and is_hidden(world, count, x, y, dx, dy, -1):
            continue
        nearest = squared_m2
        _write_blob(row, contract.PACK, math.sqrt(squared_m2), ahead_m, dy * cosine - dx * sine)
        for c in range(3):
            row[contract.PACK + contract.COLOUR + c] = world.pack_colours[pack, c]
