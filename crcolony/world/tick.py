"""One tick of the world: wheels turn, bodies move and collide, jaws latch, beacons meet, everybody looks around.

The order of a tick is the order of `advance` and `observe`. Nothing here returns to Python. A place without a body
costs no randomness: who is there lives as if the place did not exist.
"""

import math

import numpy as np
from numpy.typing import NDArray

from crcolony.body import contract
from crcolony.compiled import FloatArray, compiled
from crcolony.randomness import draw
from crcolony.world.camera import on_event, see_packs, see_robots
from crcolony.world.encounter_detection import report_encounters
from crcolony.world.infrared import sense_infrared
from crcolony.world.neighbours import find_near, sort_into_cells
from crcolony.world.packs import work_jaws
from crcolony.world.physics import pull, push, step
from crcolony.world.state import World

_MAX_STEP_RADII = 0.6
"""Share of its radius that a robot moves at most in one physics step."""
_BEARINGS = (
    contract.PACK + contract.BEARING,
    contract.FACE + contract.BEARING,
    contract.TAIL + contract.BEARING,
)


@compiled
def step_world(world: World, actions: FloatArray, fresh: NDArray[np.bool_]) -> None:
    """Command all whose action is fresh (robots,), let a control period pass, and let everybody observe."""
    for i in range(actions.shape[0]):
        if fresh[i]:
            command(world, i, actions[i])
    advance(world)
    observe(world)


@compiled
def command(world: World, i: int, action: FloatArray) -> None:
    """Give robot i a fresh action (within its limits); it acts after the configured latency, if it has a body."""
    if world.colonies[i] < 0:
        return
    for column in range(contract.ACTION_WIDTH):
        world.pending[0, i, column] = action[column]
    world.left_s[i] = action[contract.TTL]


@compiled
def advance(world: World) -> None:
    """Let one control period pass: from the actions in force to new poses, charges and encounters."""
    rules = world.rules
    _apply_actions(world)
    steps = _physics_steps(world)
    step_s = rules.period_s / steps
    for _ in range(steps):
        push(world.physics, world.poses, world.wheels, rules.track_m, step_s)
        step(world.physics, step_s)
        pull(world.physics, world.poses, world.velocities)
    if rules.wall_turn_rad > 0.0:
        _turn_at_walls(world)
    for i in range(world.poses.shape[0]):
        world.headings[i, 0] = math.cos(world.poses[i, 2])
        world.headings[i, 1] = math.sin(world.poses[i, 2])
    sort_into_cells(world.robot_cells, world.poses)
    work_jaws(world)
    sort_into_cells(world.pack_cells, world.packs)
    report_encounters(world)


@compiled
def _apply_actions(world: World) -> None:
    """Put the actions due into force; a robot whose last command has outlived its time to live stops."""
    period_s = world.rules.period_s
    delay = world.pending.shape[0] - 1
    for i in range(world.actions.shape[0]):
        is_stale = world.left_s[i] <= 0.0
        world.left_s[i] -= period_s
        for column in range(contract.ACTION_WIDTH):
            if is_stale:
                world.pending[0, i, column] = 0.0
            world.actions[i, column] = world.pending[delay, i, column]
            for age in range(delay, 0, -1):
                world.pending[age, i, column] = world.pending[age - 1, i, column]
        world.wheels[i, 0] = world.actions[i, contract.WHEEL_LEFT]
        world.wheels[i, 1] = world.actions[i, contract.WHEEL_RIGHT]


@compiled
def _physics_steps(world: World) -> int:
    """How many physics steps this period takes: more than configured where a robot would jump over a wall in one."""
    rules = world.rules
    fastest = 0.0
    for i in range(world.wheels.shape[0]):
        fastest = max(fastest, abs(world.wheels[i, 0] + world.wheels[i, 1]))
    way_m = 0.5 * fastest * rules.period_s
    return max(rules.physics_steps, math.ceil(way_m / (_MAX_STEP_RADII * rules.radius_m)))


@compiled
def _turn_at_walls(world: World) -> None:
    """The reflex world: whoever touches the outer wall is turned by a random angle."""
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
    """Write what every body senses now; the observations due are the last of `world.observations`."""
    rules = world.rules
    _shift_delay_line(world.observations)
    rows = world.observations[0]
    looks_around = rules.camera or rules.infrared or rules.microphones
    for i in range(world.poses.shape[0]):
        if world.colonies[i] < 0:
            continue
        row = rows[i]
        count = 0
        if looks_around:
            x, y = world.poses[i, 0], world.poses[i, 1]
            sight_m = _sight(world)
            count = find_near(world.robot_cells, world.poses, x, y, sight_m, world.near)
        if rules.camera:
            see_robots(world, i, count, row)
            see_packs(world, i, count, row)
        if rules.infrared:
            sense_infrared(world, i, count, row)
        if rules.inertial:
            _sense_inertial(world, i, row)
        if rules.microphones:
            on_event(world, i, count, row)
        _sense_proprioception(world, i, row)
        if rules.noisy:
            _add_noise(world, row)


@compiled
def _shift_delay_line(observations: FloatArray) -> None:
    """Make room for the newest observation: every older one moves a place back, and the first is cleared."""
    ages, robots, width = observations.shape
    for age in range(ages - 1, -1, -1):
        for i in range(robots):
            for column in range(width):
                observations[age, i, column] = observations[age - 1, i, column] if age > 0 else 0.0


@compiled
def _sight(world: World) -> float:
    """How far a robot has to know of other bodies (m)."""
    rules = world.rules
    sight_m = rules.camera_range_m if rules.camera else 0.0
    if rules.infrared:
        reach_m = max(rules.ir_range_m, rules.proximity_range_m)
        sight_m = max(sight_m, reach_m + 2.0 * rules.radius_m)
    if rules.microphones:
        sight_m = max(sight_m, rules.hearing_range_m)
    return sight_m


@compiled
def _sense_inertial(world: World, i: int, row: FloatArray) -> None:
    """Write gyro, accelerometer and wheel speeds; the accelerometer compares with the last observation's wheels."""
    period_s = world.rules.period_s
    vx, vy, turn = world.velocities[i, 0], world.velocities[i, 1], world.velocities[i, 2]
    ahead = vx * world.headings[i, 0] + vy * world.headings[i, 1]
    row[contract.GYRO] = turn
    row[contract.ACCELERATION] = (ahead - world.speeds[i]) / period_s
    row[contract.ACCELERATION + 1] = ahead * turn
    row[contract.WHEELS] = world.wheels[i, 0]
    row[contract.WHEELS + 1] = world.wheels[i, 1]
    world.speeds[i] = ahead


@compiled
def _sense_proprioception(world: World, i: int, row: FloatArray) -> None:
    """Write jaw, charge, the body's own battery, and the encounter."""
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
    """Add Gaussian noise to what was sensed (Box and Muller 1958); what was not seen stays unseen."""
    for column in range(row.shape[0]):
        deviation = world.noise[column]
        if deviation == 0.0 or (column < contract.IR_RANGE and row[column] == 0.0):
            continue
        size = math.sqrt(-2.0 * math.log(1.0 - draw(world.stream)))
        row[column] += deviation * size * math.cos(2.0 * math.pi * draw(world.stream))
        is_distance = column < contract.GYRO and column not in _BEARINGS
        if is_distance and row[column] < 0.0:
            row[column] = 0.0
