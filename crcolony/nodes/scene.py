"""The scene of an arena: the pose and signals of every body, and the battery packs, for observers."""

import itertools
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from crcolony.body import contract
from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import Scene, ScenePack, SceneRobot
from crcolony.world.state import World

MAX_ROBOTS = 1_000
"""As many bodies fit into a scene's bytes, however long the names of their colonies are."""
MAX_PACKS = 2_000
"""As many battery packs fit beside them."""


class SceneBody(NamedTuple):
    """The robot, and its colony, whose body is in a slot of a world."""

    robot: RobotId
    colony: str
    slot: int


def make_scene(
    world: World,
    bodies: Iterable[SceneBody],
    arena: str,
    arena_run: int,
    seq: int,
    tick: int,
    unix_ms: int,
) -> Scene:
    """Return the scene of a world, with as many bodies and packs as a message holds."""
    rules = world.rules
    packs = np.hstack([world.packs, world.pack_colours, world.pack_charges[:, None]])
    return Scene(
        arena=arena,
        arena_run=arena_run,
        seq=seq,
        tick=tick,
        unix_ms=unix_ms,
        period_s=rules.period_s,
        width_m=rules.width_m,
        height_m=rules.height_m,
        robots=[_scene_robot(world, body) for body in itertools.islice(bodies, MAX_ROBOTS)],
        packs=[ScenePack(*pack) for pack in packs[:MAX_PACKS].tolist()],
    )


def _scene_robot(world: World, body: SceneBody) -> SceneRobot:
    x_m, y_m, heading_rad = world.poses[body.slot].tolist()
    action = world.actions[body.slot].tolist()
    red, green, blue = action[contract.LED : contract.LED + 3]
    return SceneRobot(
        robot=body.robot,
        colony=body.colony,
        x_m=x_m,
        y_m=y_m,
        heading_rad=heading_rad,
        beacon=action[contract.BEACON] >= 0.5,
        red=red,
        green=green,
        blue=blue,
        holds=bool(world.holding[body.slot] >= 0),
    )
