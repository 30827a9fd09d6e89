"""Small arenas whose robots and packs are where a test puts them."""

from collections.abc import Mapping

import msgspec
import numpy as np
from numpy.typing import ArrayLike

from crcolony.body.settings import CyberRodent
from crcolony.world.arena import Arena
from crcolony.world.settings import ArenaSettings

FAR = 50.0
"""Packs that a test does not place are here."""


def new_arena(
    robots: int = 1,
    *,
    packs: int = 1,
    width_m: float = 4.0,
    seed: int = 1,
    arena: Mapping[str, object] | None = None,
    body: Mapping[str, object] | None = None,
) -> Arena:
    """Return an arena, with other settings of the arena and of the bodies by name."""
    settings = msgspec.convert({"width_m": width_m, "packs": packs, **(arena or {})}, ArenaSettings)
    return Arena(robots, settings, msgspec.convert(dict(body or {}), CyberRodent), seed)


def put(
    arena: Arena,
    poses: ArrayLike,
    packs: ArrayLike = (),
) -> None:
    """Place robots at x, y, heading (m, m, rad) and packs at x, y; other packs go far away."""
    arena.world.poses[:] = poses
    arena.world.packs[:] = FAR
    placed = np.array(packs, dtype=float).reshape(-1, 2)
    arena.world.packs[: len(placed)] = placed
    arena.update_cells()
