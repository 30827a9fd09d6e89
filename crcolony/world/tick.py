"""One tick of the world: bodies move and collide, jaws latch, encounters happen, bodies sense.

The order of a tick is that of `integrate` and `observe`. Nothing here returns to Python. No random
number is drawn for a slot without a body, so that the other bodies move as if the slot did not
exist.
"""

import math

import numpy as np
from numpy.typing import NDArray

from crcolony.body import contract
from crcolony.compiled import FloatArray, compiled
from crcolony.randomness import draw
from crcolony.world.camera import sense_packs, sense_robots
from crcolony.world.encounter_detection import detect_encounters
from crcolony.world.infrared import sense_infrared
from crcolony.world.microphones import sense_sound
from crcolony.world.neighbours import collect_near, sort_into_cells
from crcolony.world.packs import update_jaws
from crcolony.world.physics import move_bodies
from crcolony.world.state import World

_MAX_STEP_RADII = 0.6
"""Share of its radius that a robot moves at most in one physics step."""
_ROUNDING_S = 1e-9
"""A time to live below this is what rounding has left: it is over."""
_BEARINGS = (
    contract.PACK + contract.BEARING,
    contract.FACE + contract.BEARING,
    contract.TAIL + contract.BEARING,
)
"""Columns that may be negative."""


@compiled
def step_world(world: World, actions: FloatArray, fresh: NDArray[np.bool_]) -> None:
    """Set the actions (robots, ACTION_WIDTH) that are fresh (robots,), simulate a control period,
    and observe."""
    for i in range(actions.shape[0]):
        if fresh[i]:
            set_action(world, i, actions[i])
    integrate(world)
    observe(world)


@compiled
def set_action(world: World, i: int, action: FloatArray) -> None:
    """Set a fresh action (ACTION_WIDTH,) of robot i, within its limits; it is applied after the
    action latency.

    Nothing happens if there is no body in slot i.
    """
    if world.colonies[i] < 0:
        return
    for column in range(contract.ACTION_WIDTH):
        world.pending[0, i, column] = action[column]
    world.ttl_left_s[i] = action[contract.TTL]


@compiled
def integrate(world: World) -> None:
    """Simulate one control period: from the actions that were set to new poses, charges and
    encounters."""
    rules = world.rules
    _apply_actions(world)
    steps = _physics_steps(world)
    step_s = rules.period_s / steps
    for _ in range(steps):
        move_bodies(
            world.physics,
            world.poses,
            world.velocities,
            world.wheel_speeds,
            rules.track_m,
            step_s,
        )
    if rules.wall_turn_rad > 0.0:
        _turn_at_walls(world)
    for i in range(world.poses.shape[0]):
        world.headings[i, 0] = math.cos(world.poses[i, 2])
        world.headings[i, 1] = math.sin(world.poses[i, 2])
    sort_into_cells(world.robot_cells, world.poses)
    if update_jaws(world):
        sort_into_cells(world.pack_cells, world.packs)
    detect_encounters(world)


@compiled
def _apply_actions(world: World) -> None:
    """Apply the actions that are due; a robot whose last action is older than its time to live
    stops."""
    period_s = world.rules.period_s
    delay = world.pending.shape[0] - 1
    for i in range(world.actions.shape[0]):
        is_expired = world.ttl_left_s[i] <= _ROUNDING_S
        world.ttl_left_s[i] -= period_s
        for column in range(contract.ACTION_WIDTH):
            if is_expired:
                world.pending[0, i, column] = 0.0
            world.actions[i, column] = world.pending[delay, i, column]
            for age in range(delay, 0, -1):
                world.pending[age, i, column] = world.pending[age - 1, i, column]
        world.wheel_speeds[i, 0] = world.actions[i, contract.WHEEL_LEFT]
        world.wheel_speeds[i, 1] = world.actions[i, contract.WHEEL_RIGHT]


@compiled
def _physics_steps(world: World) -> int:
    """Return the physics steps of this period: more than set where a robot would jump over a wall
    in one."""
    rules = world.rules
    fastest = 0.0
    for i in range(world.wheel_speeds.shape[0]):
        fastest = max(fastest, abs(world.wheel_speeds[i, 0] + world.wheel_speeds[i, 1]))
    distance_m = 0.5 * fastest * rules.period_s
    return max(rules.physics_steps, math.ceil(distance_m / (_MAX_STEP_RADII * rules.radius_m)))


@compiled
def _turn_at_walls(world: World) -> None:
    """Turn every robot that touches an outer wall by a random angle: the reflex that
    `wall_turn_rad` sets."""
    rules = world.rules
    reach_x = 0.5 * rules.width_m - rules.radius_m - 1e-9
    reach_y = 0.5 * rules.height_m - rules.radius_m - 1e-9
    for i in range(world.poses.shape[0]):
        if world.colonies[i] < 0:
            continue
        if abs(world.poses[i, 0]) >= reach_x or abs(world.poses[i, 1]) >= reach_y:
            world.poses[i, 2] += (2.0 * draw(world.stream) - 1.0) * rules.wall_turn_rad


@compiled
def observe(world: World) -> None:
    """Write what every body senses now; the last of `world.observations` is what robots observe."""
    rules = world.rules
    _shift_delay_line(world.observations)
    rows = world.observations[0]
    range_m = _neighbour_range_m(world)
    for i in range(world.poses.shape[0]):
        if world.colonies[i] < 0:
            continue
        row = rows[i]
        count = 0
        if range_m > 0.0:
            x, y = world.poses[i, 0], world.poses[i, 1]
            count = collect_near(world.robot_cells, x, y, range_m, world.near_bodies)
        if rules.camera:
            sense_robots(world, i, count, row)
            sense_packs(world, i, count, row)
        if rules.infrared:
            sense_infrared(world, i, count, row)
        if rules.inertial:
            _sense_inertial(world, i, row)
        if rules.microphones:
            sense_sound(world, i, count, row)
        _sense_proprioception(world, i, row)
        if rules.is_noisy:
            _add_noise(world, row)


@compiled
def _shift_delay_line(observations: FloatArray) -> None:
    """Move every observation (latency + 1, N, OBSERVATION_WIDTH) back by one, and clear the first
    for the newest."""
    ages, robots, width = observations.shape
    for age in range(ages - 1, -1, -1):
        for i in range(robots):
            for column in range(width):
                observations[age, i, column] = observations[age - 1, i, column] if age > 0 else 0.0


@compiled
def _neighbour_range_m(world: World) -> float:
    """Return the range within which other bodies matter to the senses of a robot; 0: nowhere."""
    rules = world.rules
    range_m = rules.camera_range_m if rules.camera else 0.0
    if rules.infrared:
        reach_m = max(rules.ir_range_m, rules.proximity_range_m)
        range_m = max(range_m, reach_m + 2.0 * rules.radius_m)
    if rules.microphones:
        range_m = max(range_m, rules.hearing_range_m)
    return range_m


@compiled
def _sense_inertial(world: World, i: int, row: FloatArray) -> None:
    """Write gyro, accelerometer and wheel speeds; the accelerometer compares with the last control
    period."""
    period_s = world.rules.period_s
    vx, vy, turn = world.velocities[i, 0], world.velocities[i, 1], world.velocities[i, 2]
    ahead = vx * world.headings[i, 0] + vy * world.headings[i, 1]
    row[contract.GYRO] = turn
    row[contract.ACCELERATION] = (ahead - world.last_speeds[i]) / period_s
    row[contract.ACCELERATION + 1] = ahead * turn
    row[contract.WHEELS] = world.wheel_speeds[i, 0]
    row[contract.WHEELS + 1] = world.wheel_speeds[i, 1]
    world.last_speeds[i] = ahead


@compiled
def _sense_proprioception(world: World, i: int, row: FloatArray) -> None:
    """Write jaw, charge, the level of the body's own battery, and the encounter."""
    row[contract.JAW_HOLDS] = 1.0 if world.holding[i] >= 0 else 0.0
    row[contract.CHARGE] = world.charges[i]
    level = world.batteries[i] - world.rules.battery_drain + world.charges[i]
    world.batteries[i] = min(max(level, 0.0), 1.0)
    row[contract.BATTERY] = world.batteries[i]
    row[contract.ENCOUNTER_ROBOT] = world.partners[i]
    if world.partners[i] >= 0:
        row[contract.ENCOUNTER] = 1.0
        row[contract.ENCOUNTER_NONCE] = world.nonces[i]


@compiled
def _add_noise(world: World, row: FloatArray) -> None:
    """Add Gaussian noise to an observation (row) (Box and Muller 1958), but not to blobs that are
    not visible."""
    for column in range(row.shape[0]):
        deviation = world.noise[column]
        if deviation == 0.0 or (column < contract.IR_RANGE and row[column] == 0.0):
            continue
        size = math.sqrt(-2.0 * math.log(1.0 - draw(world.stream)))
        row[column] += deviation * size * math.cos(2.0 * math.pi * draw(world.stream))
        is_distance = column < contract.GYRO and column not in _BEARINGS
        if is_distance and row[column] < 0.0:
            row[column] = 0.0
