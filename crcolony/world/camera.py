"""The camera (thesis 4.6): battery packs, faces and tail lamps with distance and bearing."""

import math

from crcolony.body import contract
from crcolony.compiled import FloatArray, as_index, compiled
from crcolony.world.neighbours import collect_near
from crcolony.world.state import World

_SQUARED = 3
"""Column of what is near: the squared distance (m^2)."""
_FACE = 4
"""Column of `near_bodies`: the squared distance of a face that is in view, or inf."""
_TAIL = 5
"""Column of `near_bodies`: the squared distance of a tail lamp that is in view, or inf."""


@compiled
def is_hidden(
    world: World, count: int, x: float, y: float, dx: float, dy: float, target: int
) -> bool:
    """Return whether something stands between a robot at x, y and the point dx, dy (m) away from
    it.

    `world.near_bodies` has the `count` bodies around the robot. The body in row `target` (-1: none)
    hides nothing, and neither does the robot itself, because the line of sight starts at its centre.
    """
    squared_m2 = dx * dx + dy * dy
    radius_m = world.rules.radius_m
    for k in range(count):
        cx, cy = world.near_bodies[k, 1], world.near_bodies[k, 2]
        if _crosses(cx, cy, radius_m, dx, dy, squared_m2) and k != target:
            return True
    for k in range(world.pillars.shape[0]):
        cx, cy = world.pillars[k, 0] - x, world.pillars[k, 1] - y
        if _crosses(cx, cy, world.pillars[k, 2], dx, dy, squared_m2):
            return True
    for k in range(world.walls.shape[0]):
        if wall_crossing(world.walls[k], x, y, dx, dy) < 1.0:
            return True
    return False


@compiled
def _crosses(
    cx: float, cy: float, radius_m: float, dx: float, dy: float, squared_m2: float
) -> bool:
    """Return whether a line from the origin to dx, dy (m), `squared_m2` long, crosses a disc at cx,
    cy."""
    along = cx * dx + cy * dy
    across = cx * dy - cy * dx
    beyond_x, beyond_y = cx - dx, cy - dy
    radius_m2 = radius_m * radius_m
    is_beside = (along < squared_m2) & (across * across < radius_m2 * squared_m2)
    is_at_end = beyond_x * beyond_x + beyond_y * beyond_y < radius_m2
    return (along > 0.0) & (is_beside | is_at_end)


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
def _nearest_visible(
    world: World, x: float, y: float, count: int, found: FloatArray, most: int, column: int
) -> int:
    """Return the row of the nearest thing that nothing hides from x, y (m), or -1.

    The first `most` rows of `found` are things around, as of `collect_near`; `column` has the
    squared distance of those that are looked for, inf elsewhere, and is overwritten.
    `world.near_bodies` has `count` bodies, which may hide them.
    """
    is_body = column != _SQUARED
    while True:
        nearest, row = math.inf, -1
        for k in range(most):
            if found[k, column] < nearest:
                nearest, row = found[k, column], k
        if row < 0 or not world.rules.occlusion:
            return row
        target = row if is_body else -1
        if not is_hidden(world, count, x, y, found[row, 1], found[row, 2], target):
            return row
        found[row, column] = math.inf


@compiled
def _write_blob(
    world: World, i: int, blob: int, found: FloatArray, k: int, row: FloatArray
) -> None:
    """Write a blob for the thing in row k of `found`, but for its colour."""
    dx, dy = found[k, 1], found[k, 2]
    cosine, sine = world.headings[i, 0], world.headings[i, 1]
    row[blob] = 1.0
    row[blob + contract.DISTANCE] = math.sqrt(dx * dx + dy * dy)
    row[blob + contract.BEARING] = math.atan2(dy * cosine - dx * sine, dx * cosine + dy * sine)


@compiled
def sense_robots(world: World, i: int, count: int, row: FloatArray) -> None:
    """Write the nearest visible face and tail lamp to an observation (row).

    `world.near_bodies` has the `count` bodies around robot i.
    """
    x, y = world.poses[i, 0], world.poses[i, 1]
    bodies = world.near_bodies
    _note_faces_and_tails(world, i, count)
    face = _nearest_visible(world, x, y, count, bodies, count, _FACE)
    if face >= 0:
        _write_blob(world, i, contract.FACE, bodies, face, row)
        other = int(bodies[face, 0])
        for c in range(3):
            row[contract.FACE + contract.COLOUR + c] = world.actions[other, contract.LED + c]
    tail = _nearest_visible(world, x, y, count, bodies, count, _TAIL)
    if tail >= 0:
        _write_blob(world, i, contract.TAIL, bodies, tail, row)
        row[contract.TAIL + contract.COLOUR] = 1.0


@compiled
def _note_faces_and_tails(world: World, i: int, count: int) -> None:
    """Write the squared distances of faces and tail lamps that are in range and in view to columns
    of `world.near_bodies`, inf elsewhere."""
    cosine, sine = world.headings[i, 0], world.headings[i, 1]
    range_m2 = world.rules.camera_range_m * world.rules.camera_range_m
    bodies = world.near_bodies
    for k in range(count):
        dx, dy, squared_m2 = bodies[k, 1], bodies[k, 2], bodies[k, 3]
        other = as_index(bodies[k, 0])
        in_view = is_in_view(dx * cosine + dy * sine, squared_m2, world.rules.camera_cosine)
        is_seen = in_view & (other != i) & (squared_m2 <= range_m2)
        is_face = dx * world.headings[other, 0] + dy * world.headings[other, 1] <= 0.0
        bodies[k, _FACE] = squared_m2 if is_seen & is_face else math.inf
        bodies[k, _TAIL] = squared_m2 if is_seen & (not is_face) else math.inf


@compiled
def sense_packs(world: World, i: int, count: int, row: FloatArray) -> None:
    """Write the nearest visible battery pack that no jaw holds to an observation (row).

    `world.near_bodies` has the `count` bodies around robot i, which may hide packs.
    """
    x, y = world.poses[i, 0], world.poses[i, 1]
    cosine, sine = world.headings[i, 0], world.headings[i, 1]
    packs = world.near_packs
    most = collect_near(world.pack_cells, x, y, world.rules.camera_range_m, packs)
    for k in range(most):
        ahead_m = packs[k, 1] * cosine + packs[k, 2] * sine
        in_view = is_in_view(ahead_m, packs[k, _SQUARED], world.rules.camera_cosine)
        is_free = world.pack_holders[as_index(packs[k, 0])] < 0
        packs[k, _SQUARED] = packs[k, _SQUARED] if in_view & is_free else math.inf
    nearest = _nearest_visible(world, x, y, count, packs, most, _SQUARED)
    if nearest >= 0:
        _write_blob(world, i, contract.PACK, packs, nearest, row)
        pack = int(packs[nearest, 0])
        for c in range(3):
            row[contract.PACK + contract.COLOUR + c] = world.pack_colours[pack, c]
