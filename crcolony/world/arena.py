"""The simulated arena, shared by all robots (thesis 4.6): the arrays of the world, and physics."""

import math
from collections.abc import Mapping

import numpy as np

from crcolony.body import contract
from crcolony.body.settings import CyberRodent, Noise
from crcolony.compiled import FloatArray
from crcolony.randomness import draw, new_streams
from crcolony.world.arena_size import check_fit, pack_count, size_m
from crcolony.world.neighbours import new_cells, sort_into_cells
from crcolony.world.packs import place_pack
from crcolony.world.physics import Physics, Space
from crcolony.world.settings import ArenaSettings
from crcolony.world.state import SAVED, Rules, World, with_present_names
from crcolony.world.tick import integrate, observe, set_action

_COLOURS = np.eye(3)
"""The packs are red, green and blue, in turn."""
_MAX_NEAR = 512
"""Bodies, and packs, that a robot senses at most."""
_MAX_TRIES = 500
"""Random positions that are tried for a robot."""
_FAR_M = 1e5
"""Slots without a body are kept here: beyond any arena (at most 10 km) and the range of any sense
in it."""


class Arena:
    """A rectangle with robots, packs, walls and pillars. `world` is all of it; compiled code works
    on that.

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
        rules = _rules(arena, rodent, *size_m(arena, robots))
        self._space = _new_space(robots, arena, rodent, rules)
        packs = pack_count(arena, robots)
        self.world = _new_world(robots, packs, arena, rodent, rules, self._space.physics, seed)
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


def _new_space(robots: int, arena: ArenaSettings, rodent: CyberRodent, rules: Rules) -> Space:
    return Space(
        robots,
        rodent.radius_m,
        rodent.mass_kg,
        np.vstack([_outer_walls(rules.width_m, rules.height_m), _inner_walls(arena)]),
        _pillars(arena),
        rules.period_s / rules.physics_steps,
    )


def _new_world(
    robots: int,
    packs: int,
    arena: ArenaSettings,
    rodent: CyberRodent,
    rules: Rules,
    physics: Physics,
    seed: int,
) -> World:
    """Return the arrays of a world whose robots and packs have not been placed yet."""
    delayed_actions = (rodent.action_latency_steps + 1, robots, contract.ACTION_WIDTH)
    delayed_observations = (
        rodent.observation_latency_steps + 1,
        robots,
        contract.OBSERVATION_WIDTH,
    )
    size = (rules.width_m, rules.height_m, rules.camera_range_m)
    return World(
        colonies=np.zeros(robots, dtype=np.int64),
        poses=np.zeros((robots, 3)),
        headings=np.zeros((robots, 2)),
        velocities=np.zeros((robots, 3)),
        last_speeds=np.zeros(robots),
        wheel_speeds=np.zeros((robots, 2)),
        actions=np.zeros((robots, contract.ACTION_WIDTH)),
        pending=np.zeros(delayed_actions),
        ttl_left_s=np.zeros(robots),
        packs=np.zeros((packs, 2)),
        pack_colours=_COLOURS[np.arange(packs) % 3],
        pack_charges=np.zeros(packs),
        pack_holders=np.full(packs, -1),
        holding=np.full(robots, -1),
        charges=np.zeros(robots),
        batteries=np.ones(robots),
        partners=np.full(robots, -1),
        nonces=np.zeros(robots),
        observations=np.zeros(delayed_observations),
        stream=new_streams(seed, (0,), 1)[0],
        walls=_inner_walls(arena),
        pillars=_pillars(arena),
        noise=_noise(rodent.noise),
        near_bodies=np.zeros((min(robots, _MAX_NEAR), 4)),
        near_packs=np.zeros((max(1, min(packs, _MAX_NEAR)), 4)),
        contacts=np.zeros((4 * robots, 3)),
        nearest=np.zeros(robots, dtype=np.int64),
        robot_cells=new_cells(*size, robots),
        pack_cells=new_cells(*size, packs),
        physics=physics,
        rules=rules,
    )


def _inner_walls(arena: ArenaSettings) -> FloatArray:
    return np.array(arena.inner_walls, dtype=float).reshape(-1, 4)


def _pillars(arena: ArenaSettings) -> FloatArray:
    return np.array(arena.pillars, dtype=float).reshape(-1, 3)


def _outer_walls(width_m: float, height_m: float) -> FloatArray:
    x, y = 0.5 * width_m, 0.5 * height_m
    return np.array([[-x, -y, x, -y], [x, -y, x, y], [x, y, -x, y], [-x, y, -x, -y]])


def _wall_clearance_m(wall: FloatArray, x: float, y: float) -> float:
    """Return the distance of x, y from a wall (4,) of x1, y1, x2, y2 (m)."""
    along = wall[2:] - wall[:2]
    to = np.array([x, y]) - wall[:2]
    share = np.clip(np.dot(to, along) / max(np.dot(along, along), 1e-12), 0.0, 1.0)
    return float(np.hypot(*(to - share * along)))


def _noise(noise: Noise) -> FloatArray:
    """Return the standard deviation of every column of an observation, (OBSERVATION_WIDTH,)."""
    deviations = np.zeros(contract.OBSERVATION_WIDTH)
    for blob in (contract.PACK, contract.FACE, contract.TAIL):
        deviations[blob + contract.DISTANCE] = noise.distance_m
        deviations[blob + contract.BEARING] = noise.bearing_rad
    deviations[contract.IR_RANGE] = noise.proximity_m
    deviations[contract.PROXIMITY : contract.PROXIMITY + contract.PROXIMITY_SENSORS] = (
        noise.proximity_m
    )
    deviations[contract.GYRO] = noise.gyro_rad_s
    deviations[contract.ACCELERATION : contract.ACCELERATION + 2] = noise.acceleration_m_s2
    deviations[contract.WHEELS : contract.WHEELS + 2] = noise.wheel_m_s
    return deviations


def _rules(arena: ArenaSettings, rodent: CyberRodent, width_m: float, height_m: float) -> Rules:
    return Rules(
        width_m=width_m,
        height_m=height_m,
        period_s=arena.control_period_s,
        physics_steps=arena.physics_steps,
        wall_turn_rad=arena.wall_turn_rad,
        pack_charge=arena.pack_charge,
        pack_charge_per_step=arena.pack_charge_per_step,
        pack_wall_margin_m=arena.pack_wall_margin_m,
        pack_clearance_m=arena.pack_clearance_m,
        radius_m=rodent.radius_m,
        track_m=rodent.track_m,
        camera=rodent.camera,
        camera_range_m=rodent.camera_range_m,
        camera_cosine=math.cos(rodent.camera_half_angle_rad),
        occlusion=rodent.occlusion,
        infrared=rodent.infrared,
        ir_range_m=rodent.ir_range_m,
        proximity_range_m=rodent.proximity_range_m,
        inertial=rodent.inertial,
        microphones=rodent.microphones,
        hearing_range_m=rodent.hearing_range_m,
        jaw_reach_m=rodent.jaw_reach_m,
        jaw_cosine=math.cos(rodent.jaw_half_angle_rad),
        encounter_range_m=rodent.encounter_range_m,
        encounter_cosine=math.cos(rodent.encounter_half_angle_rad),
        battery_drain=rodent.battery_drain_per_s * arena.control_period_s,
        is_noisy=any(getattr(rodent.noise, name) > 0.0 for name in rodent.noise.__struct_fields__),
    )
