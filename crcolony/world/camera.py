"""The Cyber Rodent's camera: battery packs, faces and tail lamps as blobs with distance and bearing (thesis 4.6)."""

import math

from crcolony.body import contract
from crcolony.compiled import FloatArray, compiled
from crcolony.world.neighbours import find_near
from crcolony.world.state import World


@compiled
def hidden(world: World, count: int, x: float, y: float, dx: float, dy: float, but: int) -> bool:
    """Tell whether something stands between a robot at x, y and the point dx, dy (m) away from it.

    `world.near` holds the `count` bodies around the robot (itself too, which hides nothing: nothing lies behind a
    disc's own centre); `but` is the one looked at (or -1).
    """
    squared = dx * dx + dy * dy
    radius_m = world.rules.radius_m
    for k in range(count):
        if int(world.near[k, 0]) != but and _crosses(
            world.near[k, 1], world.near[k, 2], radius_m, dx, dy, squared
        ):
            return True
    for k in range(world.pillars.shape[0]):
        if _crosses(
            world.pillars[k, 0] - x,
            world.pillars[k, 1] - y,
            world.pillars[k, 2],
            dx,
            dy,
            squared,
        ):
            return True
    for k in range(world.walls.shape[0]):
        if wall_distance(world.walls[k], x, y, dx, dy) < 1.0:
            return True
    return False


@compiled
def _crosses(cx: float, cy: float, radius_m: float, dx: float, dy: float, squared: float) -> bool:
    """Tell whether the way from the origin to dx, dy passes a disc at cx, cy."""
    along = cx * dx + cy * dy
    if along <= 0.0:
        return False
    share = min(along / squared, 1.0)
    away_x = cx - share * dx
    away_y = cy - share * dy
    return away_x * away_x + away_y * away_y < radius_m * radius_m


@compiled
def wall_distance(wall: FloatArray, x: float, y: float, dx: float, dy: float) -> float:
    """Return how far along the way dx, dy from x, y a wall (x1, y1, x2, y2) is met, as a share of it, or inf."""
    wall_x = wall[2] - wall[0]
    wall_y = wall[3] - wall[1]
    across = dx * wall_y - dy * wall_x
    if across == 0.0:
        return math.inf
    to_x = wall[0] - x
    to_y = wall[1] - y
    share: float = (to_x * wall_y - to_y * wall_x) / across
    place = (to_x * dy - to_y * dx) / across
    if share < 0.0 or place < 0.0 or place > 1.0:
        return math.inf
    return share


@compiled
def in_view(ahead: float, squared: float, cosine: float) -> bool:
    """Tell whether a point, `ahead` metres along the heading, lies within an angle given by its cosine."""
    return ahead * abs(ahead) >= cosine * abs(cosine) * squared


@compiled
def _write_blob(row: FloatArray, what: int, distance_m: float, ahead: float, left: float) -> None:
    row[what] = 1.0
    row[what + contract.DISTANCE] = distance_m
    row[what + contract.BEARING] = math.atan2(left, ahead)


@compiled
def see_robots(world: World, i: int, count: int, row: FloatArray) -> None:
    """Write the nearest visible face and tail lamp into an observation."""
    cosine, sine = world.headings[i, 0], world.headings[i, 1]
    nearest_face, nearest_tail = math.inf, math.inf
    for k in range(count):
        dx, dy, squared = world.near[k, 1], world.near[k, 2], world.near[k, 3]
        ahead = dx * cosine + dy * sine
        other = int(world.near[k, 0])
        if other == i or not in_view(ahead, squared, world.rules.camera_cosine):
            continue
        faces = dx * world.headings[other, 0] + dy * world.headings[other, 1] <= 0.0
        if squared >= (nearest_face if faces else nearest_tail):
            continue
        if world.rules.occlusion and hidden(
            world, count, world.poses[i, 0], world.poses[i, 1], dx, dy, other
        ):
            continue
        what = contract.FACE if faces else contract.TAIL
        _write_blob(row, what, math.sqrt(squared), ahead, dy * cosine - dx * sine)
        if faces:
            nearest_face = squared
            for c in range(3):
                row[contract.FACE + contract.COLOUR + c] = world.actions[other, contract.LED + c]
        else:
            nearest_tail = squared
            row[contract.TAIL + contract.COLOUR] = 1.0


@compiled
def see_packs(world: World, i: int, count: int, row: FloatArray) -> None:
    """Write the nearest visible battery pack that no jaw holds into an observation."""
    x, y = world.poses[i, 0], world.poses[i, 1]
    cosine, sine = world.headings[i, 0], world.headings[i, 1]
    found = find_near(world.pack_cells, world.packs, x, y, world.rules.camera_range_m, world.blobs)
    nearest = math.inf
    for k in range(found):
        pack = int(world.blobs[k, 0])
        dx, dy, squared = world.blobs[k, 1], world.blobs[k, 2], world.blobs[k, 3]
        if squared >= nearest or world.pack_holders[pack] >= 0:
            continue
        ahead = dx * cosine + dy * sine
        if not in_view(ahead, squared, world.rules.camera_cosine):
            continue
        if world.rules.occlusion and hidden(world, count, x, y, dx, dy, -1):
            continue
        nearest = squared
        _write_blob(row, contract.PACK, math.sqrt(squared), ahead, dy * cosine - dx * sine)
        for c in range(3):
            row[contract.PACK + contract.COLOUR + c] = world.pack_colours[pack, c]


@compiled
def on_event(world: World, i: int, count: int, row: FloatArray) -> None:
    """Write the loudness at both microphones: it fades with distance, and the ear turned away hears half."""
    cosine, sine = world.headings[i, 0], world.headings[i, 1]
    for k in range(count):
        loudness = world.actions[int(world.near[k, 0]), contract.SPEAKER]
        dx, dy, squared = world.near[k, 1], world.near[k, 2], world.near[k, 3]
        distance_m = math.sqrt(squared)
        if loudness == 0.0 or distance_m > world.rules.hearing_range_m:
            continue
        loudness /= 1.0 + squared / 0.25
        side = (dy * cosine - dx * sine) / max(distance_m, 1e-9)
        left, right = contract.MICROPHONES, contract.MICROPHONES + 1
        row[left] = min(1.0, row[left] + loudness * (0.75 + 0.25 * side))
        row[right] = min(1.0, row[right] + loudness * (0.75 - 0.25 * side))
