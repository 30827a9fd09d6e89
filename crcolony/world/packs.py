"""Battery packs and the jaws that latch on them: a pack held by a jaw charges its holder, and is then replaced."""

import math

from crcolony.body import contract
from crcolony.compiled import compiled
from crcolony.randomness import draw
from crcolony.world.camera import in_view
from crcolony.world.neighbours import find_near
from crcolony.world.state import World

_TRIES = 20
_EMPTY = 1e-9
"""What is left of a pack by rounding is no charge."""
_IN_JAW_M = 0.02
"""How far in front of the hull a jaw holds a pack."""


@compiled
def place_pack(world: World, pack: int) -> None:
    """Put a full pack at a random place, clear of robots and packs where one of a few tries finds such a place."""
    rules = world.rules
    half_x = max(0.5 * rules.width_m - rules.pack_wall_margin_m, 0.0)
    half_y = max(0.5 * rules.height_m - rules.pack_wall_margin_m, 0.0)
    for _ in range(_TRIES):
        x = (2.0 * draw(world.stream) - 1.0) * half_x
        y = (2.0 * draw(world.stream) - 1.0) * half_y
        world.packs[pack, 0] = x
        world.packs[pack, 1] = y
        if _is_clear(world, pack, x, y):
            break
    world.pack_charges[pack] = rules.pack_charge
    world.pack_holders[pack] = -1


@compiled
def _is_clear(world: World, pack: int, x: float, y: float) -> bool:
    clearance_m = world.rules.pack_clearance_m
    if find_near(world.robot_cells, world.poses, x, y, clearance_m, world.near) > 0:
        return False
    found = find_near(world.pack_cells, world.packs, x, y, clearance_m, world.blobs)
    for k in range(found):
        if int(world.blobs[k, 0]) != pack:
            return False
    for k in range(world.pillars.shape[0]):
        away = math.hypot(world.pillars[k, 0] - x, world.pillars[k, 1] - y)
        if away < world.pillars[k, 2] + world.rules.radius_m:
            return False
    return True


@compiled
def work_jaws(world: World) -> None:
    """Let every closed jaw latch on a pack in reach and take its charge, and every open one let go."""
    for i in range(world.poses.shape[0]):
        world.charges[i] = 0.0
        if world.actions[i, contract.JAW] >= 0.5:
            if world.holding[i] < 0:
                _latch(world, i)
            if world.holding[i] >= 0:
                _take_charge(world, i, world.holding[i])
        elif world.holding[i] >= 0:
            world.pack_holders[world.holding[i]] = -1
            world.holding[i] = -1


@compiled
def _latch(world: World, i: int) -> None:
    rules = world.rules
    x, y = world.poses[i, 0], world.poses[i, 1]
    cosine, sine = world.headings[i, 0], world.headings[i, 1]
    found = find_near(world.pack_cells, world.packs, x, y, rules.jaw_reach_m, world.blobs)
    nearest = math.inf
    for k in range(found):
        pack = int(world.blobs[k, 0])
        dx, dy, squared = world.blobs[k, 1], world.blobs[k, 2], world.blobs[k, 3]
        if squared >= nearest or world.pack_holders[pack] >= 0:
            continue
        if in_view(dx * cosine + dy * sine, squared, rules.jaw_cosine):
            nearest = squared
            world.holding[i] = pack
    if world.holding[i] >= 0:
        world.pack_holders[world.holding[i]] = i


@compiled
def _take_charge(world: World, i: int, pack: int) -> None:
    rules = world.rules
    taken = min(rules.pack_charge_per_step, world.pack_charges[pack])
    world.charges[i] = taken
    world.pack_charges[pack] -= taken
    ahead_m = rules.radius_m + _IN_JAW_M
    world.packs[pack, 0] = world.poses[i, 0] + ahead_m * world.headings[i, 0]
    world.packs[pack, 1] = world.poses[i, 1] + ahead_m * world.headings[i, 1]
    if world.pack_charges[pack] < _EMPTY:
        world.holding[i] = -1
        place_pack(world, pack)
