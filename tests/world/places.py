"""Small worlds whose robots and packs stand where a test puts them."""

from collections.abc import Sequence

import numpy as np

from crcolony.world.arena import Arena
from crcolony.world.settings import Arena as ArenaSettings
from crcolony.world.settings import CyberRodent

FAR = 50.0
"""Packs that a test does not place stand out here."""


def new_arena(
    robots: int = 1,
    *,
    packs: int = 1,
    width_m: float = 4.0,
    seed: int = 1,
    arena: dict | None = None,
    body: dict | None = None,
) -> Arena:
    settings = ArenaSettings(width_m=width_m, packs=packs, **(arena or {}))
    return Arena(robots, settings, CyberRodent(**(body or {})), seed)


def put(
    arena: Arena,
    poses: Sequence[Sequence[float]],
    packs: Sequence[Sequence[float]] = (),
) -> None:
    """Place robots at x, y, heading (m, m, rad) and packs at x, y; other packs go far away."""
    arena.world.poses[:] = poses
    arena.world.packs[:] = FAR
    arena.world.packs[: len(packs)] = np.array(packs).reshape(-1, 2)
    arena._sort()
