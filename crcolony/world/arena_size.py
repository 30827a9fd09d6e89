"""The size of an arena, its number of packs, and whether everything fits."""

import math

from crcolony.body.settings import CyberRodent
from crcolony.world.settings import ArenaSettings


def size_m(arena: ArenaSettings, robots: int) -> tuple[float, float]:
    """Return width and height (m): as set, or those of a square that grows with the number of
    robots."""
    width_m = arena.width_m or math.sqrt(arena.area_per_robot_m2 * robots)
    return width_m, arena.height_m or width_m


def pack_count(arena: ArenaSettings, robots: int) -> int:
    """Return the number of packs: as set, or in proportion to the number of robots."""
    return arena.packs or round(arena.packs_per_robot * robots)


def check_fit(arena: ArenaSettings, rodent: CyberRodent, robots: int) -> None:
    """Raise ValueError naming the setting if robots and packs cannot be placed in the arena."""
    width_m, height_m = size_m(arena, robots)
    packs = pack_count(arena, robots)
    free_m2 = width_m * height_m - sum(math.pi * r * r for _, _, r in arena.pillars)
    if min(width_m, height_m) < 4.0 * rodent.radius_m:
        raise ValueError(f"arena.width_m: {width_m:g} x {height_m:g} m is too small for a robot")
    if free_m2 <= 0.0:
        raise ValueError("arena.pillars: they cover the whole arena")
    if robots * (3.0 * rodent.radius_m) ** 2 > free_m2:
        raise ValueError(f"robots: {robots} do not fit into {free_m2:.3g} square metres")
    if packs * (0.5 * rodent.radius_m) ** 2 > free_m2:
        raise ValueError(f"arena.packs: {packs} do not fit into {free_m2:.3g} square metres")
