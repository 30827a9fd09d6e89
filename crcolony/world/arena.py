"""The simulated arena, shared by all robots (thesis 4.6): the arrays of the world, and physics."""

import math
from collections.abc import Mapping

import numpy as np

from crcolony.body import contract
from crcolony.body.settings import CyberRodent
from crcolony.compiled import FloatArray
from crcolony.randomness import draw
from crcolony.world.arena_size import check_fit
from crcolony.world.neighbours import sort_into_cells
from crcolony.world.new_world import new_rules, new_space, new_world
from crcolony.world.packs import place_pack
from crcolony.world.settings import ArenaSettings
from crcolony.world.state import SAVED, with_present_names
from crcolony.world.tick import integrate, observe, set_action

_MAX_TRIES = 500
"""Random positions that are tried for a robot."""
_FAR_M = 1e5
"""Bodies of empty slots are here: beyond any arena (at most 10 km) and the range of any sense."""


class Arena:
    """A rectangle with robots, packs, walls and pillars. All of it is `world`, for compiled code.

    It has a slot for every robot. All slots have a body from the start, or, if not `embodied`, none
    has until `embody` is called. Raises ValueError naming the setting if robots, packs or obstacles
    do not fit.
    """

    def __init__(
        self,
        robots: int,
        arena: ArenaSettings,
        rodent: CyberRodent,
        seed: int,
        embodied: bool = True,
    ) -> None:
        check_fit(arena, rodent, robots)
        self.robots = robots
        rules = new_rules(robots, arena, rodent)
        self._space = new_space(robots, arena, rodent, rules)
        self.world = new_world(robots, arena, rodent, rules, self._space.physics, seed)
        self._place_all()
        self._homes = self.world.poses.copy()
        if not embodied:
            for slot in range(robots):
                self.remove(slot)

    def embody(self, slot: int, colony: int) -> None:
        """Add a new body at its home, where the seed placed it, or at a random position if that is
        not free.

        Raises ValueError if the slot has a body already, or no free position is found.
        """
        world = self.world
        if world.colonies[slot] >= 0:
            raise ValueError(f"slot {slot} has a body already")
        others = world.poses[world.colonies >= 0, :2]
        x, y, heading = self._homes[slot]
        if not self._is_free(x, y, others):
            x, y = self._draw_free_position(others)
        world.poses[slot] = x, y, heading
        world.colonies[slot] = colony
        self.update_cells()

    def remove(self, slot: int) -> None:
        """Remove a body; its pack stays behind, and its slot is like a new one."""
        world = self.world
        if world.holding[slot] >= 0:
            world.pack_holders[world.holding[slot]] = -1
        self._clear_encounters_with(slot)
        for field in (
            world.velocities,
            world.last_speeds,
            world.wheel_speeds,
            world.actions,
            world.ttl_left_s,
        ):
            field[slot] = 0.0
        world.pending[:, slot] = world.observations[:, slot] = 0.0
        world.charges[slot], world.batteries[slot] = 0.0, 1.0
        world.holding[slot] = world.partners[slot] = world.colonies[slot] = -1
        world.nonces[slot] = 0.0
        world.poses[slot] = _FAR_M + 4.0 * world.rules.radius_m * slot, 0.0, 0.0
        self.update_cells()

    def _clear_encounters_with(self, slot: int) -> None:
        """Remove encounters with a slot from what robots will observe: another robot may have the
        slot by then."""
        world = self.world
        world.partners[world.partners == slot] = -1
        rows = world.observations
        met = (rows[..., contract.ENCOUNTER] > 0.0) & (rows[..., contract.ENCOUNTER_ROBOT] == slot)
        for column, none in (
            (contract.ENCOUNTER, 0.0),
            (contract.ENCOUNTER_ROBOT, -1.0),
            (contract.ENCOUNTER_NONCE, 0.0),
        ):
            rows[met, column] = none

    def observe(self) -> FloatArray:
        """Return what every robot observes now, shape (N, OBSERVATION_WIDTH); call it once after
        every `integrate`."""
        observe(self.world)
        due: FloatArray = self.world.observations[-1]
        return due

    def act(self, robot: int, action: FloatArray) -> FloatArray:
        """Set the action of one robot, as `Body.act` does; return what will be applied.

        Raises ValueError as `clip_action` does.
        """
        applied = contract.clip_action(action)
        set_action(self.world, robot, applied)
        return applied

    def integrate(self) -> None:
        """Simulate one control period."""
        integrate(self.world)

    def save(self) -> dict[str, np.ndarray]:
        """Return copies of all that changes in the world: an arena that restores them has the same
        future."""
        return {name: getattr(self.world, name).copy() for name in SAVED}

    def restore(self, saved: Mapping[str, np.ndarray]) -> None:
        """Restore a saved world of the same settings, also one that an earlier version saved.

        Raises ValueError if a field is missing or has another shape.
        """
        arrays = with_present_names(saved)
        for name in SAVED:
            field = getattr(self.world, name)
            if name not in arrays or arrays[name].shape != field.shape:
                raise ValueError(f"the saved world does not fit this arena: {name}")
            field[...] = arrays[name]
        self.update_cells()

    def _place_all(self) -> None:
        """Place robots and packs at random; robots are clear of each other and of obstacles."""
        world = self.world
        for i in range(self.robots):
            world.poses[i, :2] = self._draw_free_position(world.poses[:i, :2])
        for i in range(self.robots):
            world.poses[i, 2] = (2.0 * draw(world.stream) - 1.0) * math.pi
        self.update_cells()
        for pack in range(world.packs.shape[0]):
            place_pack(world, pack)
            sort_into_cells(world.pack_cells, world.packs)

    def _draw_free_position(self, taken: FloatArray) -> tuple[float, float]:
        """Return a random position for a robot (m), clear of others at `taken` (n, 2).

        Raises ValueError if none is found.
        """
        world, rules = self.world, self.world.rules
        margin_m = rules.radius_m + 0.01
        half_x, half_y = 0.5 * rules.width_m - margin_m, 0.5 * rules.height_m - margin_m
        for _ in range(_MAX_TRIES):
            x = (2.0 * draw(world.stream) - 1.0) * half_x
            y = (2.0 * draw(world.stream) - 1.0) * half_y
            if self._is_free(x, y, taken):
                return x, y
        raise ValueError(f"arena: no free place is found beside {taken.shape[0]} robots")

    def _is_free(self, x: float, y: float, taken: FloatArray) -> bool:
        """Return whether a robot at x, y (m) would touch no pillar, no inner wall and no other at
        `taken` (n, 2)."""
        radius_m, pillars = self.world.rules.radius_m, self.world.pillars
        others_m = np.hypot(taken[:, 0] - x, taken[:, 1] - y)
        pillars_m = np.hypot(pillars[:, 0] - x, pillars[:, 1] - y) - pillars[:, 2]
        walls_m = np.array([_wall_clearance_m(wall, x, y) for wall in self.world.walls])
        return bool(
            (others_m >= 2.0 * radius_m).all()
            and (pillars_m >= radius_m).all()
            and (walls_m >= radius_m).all()
        )

    def update_cells(self) -> None:
        """Update headings and cells after poses or packs were changed from outside `integrate`."""
        world = self.world
        world.headings[:, 0] = np.cos(world.poses[:, 2])
        world.headings[:, 1] = np.sin(world.poses[:, 2])
        sort_into_cells(world.robot_cells, world.poses)
        sort_into_cells(world.pack_cells, world.packs)


def _wall_clearance_m(wall: FloatArray, x: float, y: float) -> float:
    """Return the distance of x, y from a wall (4,) of x1, y1, x2, y2 (m)."""
    along = wall[2:] - wall[:2]
    to = np.array([x, y]) - wall[:2]
    share = np.clip(np.dot(to, along) / max(np.dot(along, along), 1e-12), 0.0, 1.0)
    return float(np.hypot(*(to - share * along)))
