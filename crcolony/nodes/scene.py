"""A world as a spectator sees it: who is where, looks whither, and shows what; and where the battery packs are."""

import itertools
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from crcolony.body import contract
from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import Scene, ScenePack, SceneRobot
from crcolony.world.state import World

MAX_ROBOTS, MAX_PACKS = 1_000, 2_000
"""As many fit into a scene's bytes, however long the names of their colonies are."""


class SceneBody(NamedTuple):
    """Whose body is in which place of a world."""

    robot: RobotId
    colony: str
    slot: int


def make_scene(
    world: World,
    bodies: Iterable[SceneBody],
    arena: str,
    number: int,
    seq: int,
    tick: int,
    unix_ms: int,
) -> Scene:
    """Return a scene: of a crowd, as many as a message holds. `number` names this run of the arena."""
    rules = world.rules
    packs = np.hstack([world.packs, world.pack_colours, world.pack_charges[:, None]])
    return Scene(
        arena=arena,
        arena_run=number,
        seq=seq,
        tick=tick,
        unix_ms=unix_ms,
        period_s=rules.period_s,
        width_m=rules.width_m,
        height_m=rules.height_m,
        robots=[_seen(world, one) for one in itertools.islice(bodies, MAX_ROBOTS)],
        packs=[ScenePack(*pack) for pack in packs[:MAX_PACKS].tolist()],
    )


def _seen(world: World, one: SceneBody) -> SceneRobot:
    x_m, y_m, heading_rad = world.poses[one.slot].tolist()
    action = world.actions[one.slot].tolist()
    red, green, blue = action[contract.LED : contract.LED + 3]
    return SceneRobot(
        robot=one.robot,
        colony=one.colony,
        x_m=x_m,
        y_m=y_m,
        heading_rad=heading_rad,
        beacon=action[contract.BEACON] >= 0.5,
        red=red,
        green=green,
        blue=blue,
        holds=bool(world.holding[one.slot] >= 0),
    )
