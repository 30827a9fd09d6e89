"""Battery packs and jaws (thesis 4.6): a pack in a jaw charges its holder, and is replaced then."""

import math

from crcolony.body import contract
from crcolony.compiled import compiled
from crcolony.randomness import draw
from crcolony.world.camera import is_in_view
from crcolony.world.neighbours import collect_near
from crcolony.world.state import World

_MAX_TRIES = 20
"""Random positions that are tried for a replaced pack; the last one is used as it is."""
_EMPTY = 1e-9
"""A charge below this is what rounding has left."""
_IN_JAW_M = 0.02
"""Distance in front of the hull at which a jaw holds a pack."""


@compiled
def place_pack(world: World, pack: int) -> None:
    """Put a full pack at a random position, clear of robots and packs if one of a few tries is."""
    rules = world.rules
    half_x = max(0.5 * rules.width_m - rules.pack_wall_margin_m, 0.0)
    half_y = max(0.5 * rules.height_m - rules.pack_wall_margin_m, 0.0)
    for _ in range(_MAX_TRIES):
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
    """Return whether no robot, no other pack and no pillar is too near to x, y (m)."""
    clearance_m = world.rules.pack_clearance_m
    if collect_near(world.robot_cells, x, y, clearance_m, world.near_bodies) > 0:
        return False
    found = collect_near(world.pack_cells, x, y, clearance_m, world.near_packs)
    for k in range(found):
        if int(world.near_packs[k, 0]) != pack:
            return False
    for k in range(world.pillars.shape[0]):
        away = math.hypot(world.pillars[k, 0] - x, world.pillars[k, 1] - y)
        if away < world.pillars[k, 2] + world.rules.radius_m:
            return False
    return True


@compiled
def update_jaws(world: World) -> bool:
    """Latch every closed jaw on a pack in reach and transfer its charge; release the packs of open
    jaws; return whether a pack has moved."""
    has_moved = False
    for i in range(world.poses.shape[0]):
        world.charges[i] = 0.0
        if world.actions[i, contract.JAW] >= 0.5:
            if world.holding[i] < 0:
                _latch(world, i)
            if world.holding[i] >= 0:
                _transfer_charge(world, i, world.holding[i])
                has_moved = True
        elif world.holding[i] >= 0:
            world.pack_holders[world.holding[i]] = -1
            world.holding[i] = -1
    return has_moved


@compiled
def _latch(world: World, i: int) -> None:
    """Close robot i's jaw on the nearest free pack in reach, if there is one."""
    rules = world.rules
    x, y = world.poses[i, 0], world.poses[i, 1]
    cosine, sine = world.headings[i, 0], world.headings[i, 1]
    found = collect_near(world.pack_cells, x, y, rules.jaw_reach_m, world.near_packs)
    nearest = math.inf
    for k in range(found):
        pack = int(world.near_packs[k, 0])
        dx, dy, squared_m2 = world.near_packs[k, 1], world.near_packs[k, 2], world.near_packs[k, 3]
        if squared_m2 >= nearest or world.pack_holders[pack] >= 0:
            continue
        if is_in_view(dx * cosine + dy * sine, squared_m2, rules.jaw_cosine):
            nearest = squared_m2
            world.holding[i] = pack
    if world.holding[i] >= 0:
        world.pack_holders[world.holding[i]] = i


@compiled
def _transfer_charge(world: World, i: int, pack: int) -> None:
    """Charge robot i from the pack in its jaw, and carry the pack along; replace it when it is
    empty."""
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
