"""The arena: nature, shared by all robots and selecting none (thesis 4.6). It owns the arrays and their physics."""

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
from crcolony.world.physics import Space
from crcolony.world.settings import ArenaSettings
from crcolony.world.state import SAVED, Rules, World
from crcolony.world.tick import advance, command, observe

_COLOURS = np.eye(3)
_MAX_NEAR = 512
_TRIES = 500
_FAR_M = 1e5
"""Where bodies are parked that are not there: beyond any arena (at most 10 km) and any sense in it."""


class Arena:
    """A rectangle with robots, packs, walls and pillars. `world` is all of it; compiled code works on that.

    It has a place for every robot. All have a body from the start, or, if not `embodied`, none has until `embody`
    gives it one. Raises ValueError naming the setting if robots, packs or obstacles do not fit.
    """

    def __init__(
        self,
        robots: int,
        arena: ArenaSettings,
        rodent: CyberRodent,
        seed: int,
        embodied: bool = True,
    ) -> None:
        self.robots = robots
        width_m, height_m = size_m(arena, robots)
        packs = pack_count(arena, robots)
        check_fit(arena, rodent, robots)
        inner_walls = np.array(arena.inner_walls, dtype=float).reshape(-1, 4)
        pillars = np.array(arena.pillars, dtype=float).reshape(-1, 3)
        rules = _rules(arena, rodent, width_m, height_m)
        self._space = Space(
            robots,
            rodent.radius_m,
            rodent.mass_kg,
            np.vstack([_outer_walls(width_m, height_m), inner_walls]),
            pillars,
            rules.period_s / rules.physics_steps,
        )
        self.world = World(
            colonies=np.zeros(robots, dtype=np.int64),
            poses=np.zeros((robots, 3)),
            headings=np.zeros((robots, 2)),
            velocities=np.zeros((robots, 3)),
            speeds=np.zeros(robots),
            wheels=np.zeros((robots, 2)),
            actions=np.zeros((robots, contract.ACTION_WIDTH)),
            pending=np.zeros((rodent.action_latency_steps + 1, robots, contract.ACTION_WIDTH)),
            left_s=np.zeros(robots),
            packs=np.zeros((packs, 2)),
            pack_colours=_COLOURS[np.arange(packs) % 3],
            pack_charges=np.zeros(packs),
            pack_holders=np.full(packs, -1),
            holding=np.full(robots, -1),
            charges=np.zeros(robots),
            batteries=np.ones(robots),
            partners=np.full(robots, -1),
            nonces=np.zeros(robots),
            observations=np.zeros(
                (rodent.observation_latency_steps + 1, robots, contract.OBSERVATION_WIDTH)
            ),
            stream=new_streams(seed, (0,), 1)[0],
            walls=inner_walls,
            pillars=pillars,
            noise=_noise(rodent.noise),
            near=np.zeros((min(robots, _MAX_NEAR), 4)),
            blobs=np.zeros((max(1, min(packs, _MAX_NEAR)), 4)),
            contacts=np.zeros((4 * robots, 3)),
            nearest=np.zeros(robots, dtype=np.int64),
            robot_cells=new_cells(width_m, height_m, rodent.camera_range_m, robots),
            pack_cells=new_cells(width_m, height_m, rodent.camera_range_m, packs),
            physics=self._space.physics,
            rules=rules,
        )
        self._scatter()
        self._homes = self.world.poses.copy()
        if not embodied:
            for slot in range(robots):
                self.remove(slot)

    def embody(self, slot: int, colony: int) -> None:
        """Let a fresh body appear at its home, where the seed scattered it, or at a random place if that is taken.

        Raises ValueError if there is a body already, or no free place is found.
        """
        world = self.world
        if world.colonies[slot] >= 0:
            raise ValueError(f"place {slot}: there is a body already")
        others = world.poses[world.colonies >= 0, :2]
        x, y, heading = self._homes[slot]
        if not self._is_free(x, y, others):
            x, y = self._free_place(others)
        world.poses[slot] = x, y, heading
        world.colonies[slot] = colony
        self._sort()

    def remove(self, slot: int) -> None:
        """Take a body away, leaving its pack behind, and its place as fresh as a new one."""
        world = self.world
        if world.holding[slot] >= 0:
            world.pack_holders[world.holding[slot]] = -1
        self._forget_encounters_with(slot)
        for field in (world.velocities, world.speeds, world.wheels, world.actions, world.left_s):
            field[slot] = 0.0
        world.pending[:, slot] = world.observations[:, slot] = 0.0
        world.charges[slot], world.batteries[slot] = 0.0, 1.0
        world.holding[slot] = world.partners[slot] = world.colonies[slot] = -1
        world.nonces[slot] = 0.0
        world.poses[slot] = _FAR_M + 4.0 * world.rules.radius_m * slot, 0.0, 0.0
        self._sort()

    def _forget_encounters_with(self, slot: int) -> None:
        """Nobody is to hear of meeting a place that somebody else may have by then."""
        world = self.world
        world.partners[world.partners == slot] = -1
        rows = world.observations
        met = (rows[..., contract.ENCOUNTER] > 0.0) & (rows[..., contract.ENCOUNTER_ROBOT] == slot)
        for column, nothing in (
            (contract.ENCOUNTER, 0.0),
            (contract.ENCOUNTER_ROBOT, -1.0),
            (contract.ENCOUNTER_NONCE, 0.0),
        ):
            rows[met, column] = nothing

    def observe(self) -> FloatArray:
        """Return what every robot senses now, shape (N, OBSERVATION_WIDTH); call it once after every tick."""
        observe(self.world)
        due: FloatArray = self.world.observations[-1]
        return due

    def act(self, robot: int, action: FloatArray) -> FloatArray:
        """Command one robot as `Body.act` says; return what will be applied."""
        applied = contract.clip_action(action)
        command(self.world, robot, applied)
        return applied

    def advance(self) -> None:
        """Let one control period pass."""
        advance(self.world)

    def save(self) -> dict[str, np.ndarray]:
        """Return all that changes in the world, as copies; `restore` makes an equal arena go on identically."""
        return {name: getattr(self.world, name).copy() for name in SAVED}

    def restore(self, saved: Mapping[str, np.ndarray]) -> None:
        """Go back to a saved world of the same settings; raises ValueError if its shapes differ."""
        for name in SAVED:
            field = getattr(self.world, name)
            if name not in saved or saved[name].shape != field.shape:
                raise ValueError(f"the saved world does not fit this arena: {name}")
            field[...] = saved[name]
        self._sort()

    def _scatter(self) -> None:
        """Place robots and packs at random, robots clear of each other and of obstacles."""
        world = self.world
        for i in range(self.robots):
            world.poses[i, :2] = self._free_place(world.poses[:i, :2])
        for i in range(self.robots):
            world.poses[i, 2] = (2.0 * draw(world.stream) - 1.0) * math.pi
        self._sort()
        for pack in range(world.packs.shape[0]):
            place_pack(world, pack)
            sort_into_cells(world.pack_cells, world.packs)

    def _free_place(self, taken: FloatArray) -> tuple[float, float]:
        """Return a random place for a robot, clear of others at `taken` (n, 2); raises ValueError if none is found."""
        world, rules = self.world, self.world.rules
        margin_m = rules.radius_m + 0.01
        half_x, half_y = 0.5 * rules.width_m - margin_m, 0.5 * rules.height_m - margin_m
        for _ in range(_TRIES):
            x = (2.0 * draw(world.stream) - 1.0) * half_x
            y = (2.0 * draw(world.stream) - 1.0) * half_y
            if self._is_free(x, y, taken):
                return x, y
        raise ValueError(f"arena: no free place is found beside {taken.shape[0]} robots")

    def _is_free(self, x: float, y: float, taken: FloatArray) -> bool:
        radius_m, pillars = self.world.rules.radius_m, self.world.pillars
        others_m = np.hypot(taken[:, 0] - x, taken[:, 1] - y)
        pillars_m = np.hypot(pillars[:, 0] - x, pillars[:, 1] - y) - pillars[:, 2]
        walls_m = np.array([_wall_clearance(wall, x, y) for wall in self.world.walls])
        return bool(
            (others_m >= 2.0 * radius_m).all()
            and (pillars_m >= radius_m).all()
            and (walls_m >= radius_m).all()
        )

    def _sort(self) -> None:
        world = self.world
        world.headings[:, 0] = np.cos(world.poses[:, 2])
        world.headings[:, 1] = np.sin(world.poses[:, 2])
        sort_into_cells(world.robot_cells, world.poses)
        sort_into_cells(world.pack_cells, world.packs)


def _outer_walls(width_m: float, height_m: float) -> FloatArray:
    x, y = 0.5 * width_m, 0.5 * height_m
    return np.array([[-x, -y, x, -y], [x, -y, x, y], [x, y, -x, y], [-x, y, -x, -y]])


def _wall_clearance(wall: FloatArray, x: float, y: float) -> float:
    along = wall[2:] - wall[:2]
    to = np.array([x, y]) - wall[:2]
    share = np.clip(np.dot(to, along) / max(np.dot(along, along), 1e-12), 0.0, 1.0)
    return float(np.hypot(*(to - share * along)))


def _noise(noise: Noise) -> FloatArray:
    deviations = np.zeros(contract.OBSERVATION_WIDTH)
    for what in (contract.PACK, contract.FACE, contract.TAIL):
        deviations[what + contract.DISTANCE] = noise.distance_m
        deviations[what + contract.BEARING] = noise.bearing_rad
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
        noisy=any(getattr(rodent.noise, name) > 0.0 for name in rodent.noise.__struct_fields__),
    )
