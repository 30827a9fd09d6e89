"""A tick: actions are applied for as long as their time to live, and all bodies observe."""

import math

import numpy as np
import pytest

from crcolony.body import contract
from crcolony.body.settings import Noise
from crcolony.compiled import FloatArray
from crcolony.world.arena import Arena
from crcolony.world.tick import step_world
from tests.support.small_arenas import new_arena, put


def forward(speed_m_s: float = 0.3, ttl_s: float = 0.5) -> FloatArray:
    """Return an action to drive straight ahead."""
    action = np.zeros(contract.ACTION_WIDTH)
    action[contract.WHEEL_LEFT] = action[contract.WHEEL_RIGHT] = speed_m_s
    action[contract.TTL] = ttl_s
    return action


def distances_m(arena: Arena, ticks: int) -> list[float]:
    """Return how far the first robot moves in each tick."""
    distances = []
    for _ in range(ticks):
        before = arena.world.poses[0, :2].copy()
        arena.integrate()
        distances.append(float(np.hypot(*(arena.world.poses[0, :2] - before))))
    return distances


def test_a_body_without_a_fresh_action_stops_when_the_time_to_live_is_over() -> None:
    """Half a second is three periods of 0.2 s; then wheels, beacon, jaw and lamp are off until the
    next action."""
    arena = new_arena()
    put(arena, [(0.0, 0.0, 0.0)])
    action = forward(ttl_s=0.5)
    action[[contract.BEACON, contract.JAW, contract.LED]] = 1.0
    arena.act(0, action)
    assert distances_m(arena, 6) == pytest.approx([0.06, 0.06, 0.06, 0.0, 0.0, 0.0])
    assert not arena.world.actions[0].any()
    arena.act(0, action)
    assert distances_m(arena, 1) == pytest.approx([0.06])


def test_a_body_without_any_action_stands_still() -> None:
    """From the first tick on."""
    arena = new_arena()
    put(arena, [(0.0, 0.0, 0.0)])
    assert distances_m(arena, 3) == [0.0, 0.0, 0.0]


def test_a_time_to_live_of_zero_is_no_action() -> None:
    """It is over before it is applied."""
    arena = new_arena()
    put(arena, [(0.0, 0.0, 0.0)])
    arena.act(0, forward(ttl_s=0.0))
    assert distances_m(arena, 2) == [0.0, 0.0]


@pytest.mark.parametrize("latency", [0, 1, 3])
def test_an_action_is_applied_after_its_latency(latency: int) -> None:
    """Every action is, in order."""
    arena = new_arena(body={"action_latency_steps": latency})
    put(arena, [(-1.0, 0.0, 0.0)])
    distances = []
    for speed in (0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 0.0):
        arena.act(0, forward(speed))
        distances += distances_m(arena, 1)
    expected = [0.0] * latency + [0.02, 0.04, 0.06, 0.0, 0.0, 0.0, 0.0]
    assert distances == pytest.approx(expected[:7])


@pytest.mark.parametrize("latency", [0, 1, 3])
def test_observations_are_as_old_as_their_latency(latency: int) -> None:
    """A robot sees where the pack was some periods ago, and nothing before the first
    observation."""
    arena = new_arena(body={"observation_latency_steps": latency})
    distances = []
    for tick in range(6):
        put(arena, [(0.0, 0.0, 0.0)], [(0.5 + 0.1 * tick, 0.0)])
        distances.append(float(arena.observe()[0, contract.PACK + contract.DISTANCE]))
    expected = [0.0] * latency + [0.5, 0.6, 0.7, 0.8, 0.9, 1.0]
    assert distances == pytest.approx(expected[:6])


def test_noise_has_the_deviation_that_was_set() -> None:
    """It is on distance and bearing of visible blobs only, and distances are not negative."""
    arena = new_arena(body={"noise": Noise(distance_m=0.05, bearing_rad=0.02)})
    put(arena, [(0.0, 0.0, 0.0)], [(0.8, 0.3)])
    rows = np.array([arena.observe()[0].copy() for _ in range(4000)])
    distance, bearing = (
        rows[:, contract.PACK + contract.DISTANCE],
        rows[:, contract.PACK + contract.BEARING],
    )
    assert distance.mean() == pytest.approx(math.hypot(0.8, 0.3), abs=0.004)
    assert distance.std() == pytest.approx(0.05, rel=0.06)
    assert bearing.mean() == pytest.approx(math.atan2(0.3, 0.8), abs=0.002)
    assert bearing.std() == pytest.approx(0.02, rel=0.06)
    assert abs(np.corrcoef(distance, bearing)[0, 1]) < 0.06
    assert not rows[:, contract.FACE : contract.IR_RANGE].any()
    put(arena, [(0.0, 0.0, 0.0)], [(0.01, 0.0)])
    rows = np.array([arena.observe()[0].copy() for _ in range(200)])
    assert rows[:, contract.PACK + contract.DISTANCE].min() == 0.0


def test_inertial_sensors_read_turning_rate_acceleration_and_wheel_speeds() -> None:
    """The accelerometer has a forward and a sideways axis."""
    arena = new_arena(width_m=8.0, body={"inertial": True})
    put(arena, [(0.0, 0.0, 0.3)])
    arena.observe()
    action = forward(0.2)
    action[contract.WHEEL_RIGHT] = 0.28
    readings = []
    for _ in range(2):
        arena.act(0, action)
        arena.integrate()
        readings.append(arena.observe()[0].copy())
    turn = 0.08 / 0.16
    for row in readings:
        assert row[contract.GYRO] == pytest.approx(turn)
        assert row[contract.WHEELS : contract.WHEELS + 2].tolist() == [0.2, 0.28]
        assert row[contract.ACCELERATION + 1] == pytest.approx(0.24 * turn, rel=0.01)
    assert readings[0][contract.ACCELERATION] == pytest.approx(0.24 / 0.2, rel=0.01)
    assert readings[1][contract.ACCELERATION] == pytest.approx(0.0, abs=1e-9)


def test_a_step_is_set_action_then_integrate_then_observe() -> None:
    """Only fresh actions are set; the other robots keep their last ones."""
    one, other = new_arena(3, seed=3), new_arena(3, seed=3)
    actions = np.array([forward(0.1), forward(0.2), forward(0.3)])
    for fresh in ([True, True, False], [False, True, True], [False, False, False]):
        for robot in np.flatnonzero(fresh):
            one.act(int(robot), actions[robot])
        one.integrate()
        expected = one.observe()
        step_world(other.world, actions, np.array(fresh))
        assert np.array_equal(other.world.observations[-1], expected)
        assert np.array_equal(other.world.poses, one.world.poses)
    assert other.world.wheel_speeds[:, 0].tolist() == [0.1, 0.2, 0.3]


def test_a_slot_without_a_body_is_not_turned_at_walls() -> None:
    """Though it is beyond the walls, no random number is drawn for it."""
    arena = new_arena(2, arena={"wall_turn_rad": 1.0})
    arena.remove(1)
    put(arena, [(0.0, 0.0, 0.0), arena.world.poses[1]])
    before = arena.world.stream.copy()
    arena.integrate()
    assert np.array_equal(arena.world.stream, before)
    assert arena.world.poses[1, 2] == 0.0


def test_senses_that_are_off_read_0() -> None:
    """Only jaw, charge, battery and encounter are always on."""
    arena = new_arena(2, body={"camera": False})
    put(arena, [(0.0, 0.0, 0.0), (0.4, 0.0, math.pi)], [(0.3, 0.3)])
    arena.act(0, forward())
    arena.integrate()
    row = arena.observe()[0]
    assert not row[: contract.JAW_HOLDS].any()
    assert not row[contract.MICROPHONES : contract.MICROPHONES + 2].any()


def test_a_wall_turns_a_robot_by_an_angle_up_to_the_setting() -> None:
    """By default it only stops the robot."""
    for turn_rad in (0.0, 1.0):
        arena = new_arena(arena={"wall_turn_rad": turn_rad})
        put(arena, [(1.8, 0.0, 0.0)])
        headings = []
        for _ in range(8):
            arena.act(0, forward())
            arena.integrate()
            headings.append(float(arena.world.poses[0, 2]))
        turned = np.abs(np.diff([0.0, *headings]))
        assert (turned <= turn_rad + 1e-12).all()
        assert (turned.max() > 0.05) == (turn_rad > 0.0)


@pytest.mark.parametrize("speed_m_s", [0.3, 0.8, 1.3])
def test_a_fast_robot_does_not_jump_over_a_wall(speed_m_s: float) -> None:
    """A tick has as many physics steps as the fastest robot needs."""
    arena = new_arena(3, width_m=3.0, arena={"inner_walls": ((0.5, -1.0, 0.5, 1.0),)})
    put(arena, [(0.0, 0.0, 0.0), (-1.0, 0.0, math.pi), (-1.0, 1.0, 0.5 * math.pi)])
    for _ in range(40):
        for robot in range(3):
            arena.act(robot, forward(speed_m_s))
        arena.integrate()
        assert arena.world.poses[0, 0] < 0.5
        assert (np.abs(arena.world.poses[:, :2]) < 1.5).all()
    assert arena.world.poses[0, 0] == pytest.approx(0.39, abs=0.015)
