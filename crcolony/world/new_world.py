"""Making the arrays of `state.py`: rules from settings, and a world with nothing placed in it."""

import math

import numpy as np

from crcolony.body import contract
from crcolony.body.settings import CyberRodent, Noise
from crcolony.compiled import FloatArray
from crcolony.randomness import new_streams
from crcolony.world.arena_size import pack_count, size_m
from crcolony.world.neighbours import new_cells
from crcolony.world.physics import Physics, Space
from crcolony.world.settings import ArenaSettings
from crcolony.world.state import Rules, World

_COLOURS = np.eye(3)
"""The packs are red, green and blue, in turn."""
_MAX_NEAR = 512
"""Bodies, and packs, that a robot senses at most."""


def new_space(robots: int, arena: ArenaSettings, rodent: CyberRodent, rules: Rules) -> Space:
    """Return the rigid bodies of the robots, and the walls and pillars around them."""
    return Space(
        robots,
        rodent.radius_m,
        rodent.mass_kg,
        np.vstack([_outer_walls(rules.width_m, rules.height_m), _inner_walls(arena)]),
        _pillars(arena),
        rules.period_s / rules.physics_steps,
    )


def new_world(
    robots: int,
    arena: ArenaSettings,
    rodent: CyberRodent,
    rules: Rules,
    physics: Physics,
    seed: int,
) -> World:
    """Return the arrays of a world whose robots and packs have not been placed yet."""
    packs = pack_count(arena, robots)
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
        near_bodies=np.zeros((min(robots, _MAX_NEAR), 6)),
        close_bodies=np.zeros((min(robots, _MAX_NEAR), 2)),
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


def new_rules(robots: int, arena: ArenaSettings, rodent: CyberRodent) -> Rules:
    """Return the settings as compiled code reads them."""
    width_m, height_m = size_m(arena, robots)
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
