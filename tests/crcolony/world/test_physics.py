"""Bodies move by their wheel speeds and push one another; compiled steps equal pymunk's own."""

import numpy as np
import pytest

from crcolony.compiled import FloatArray
from crcolony.world.physics import Space, read_states, step_physics, write_commands

RADIUS_M, MASS_KG, TRACK_M, STEP_S = 0.11, 1.75, 0.16, 0.2


def box(width_m: float) -> FloatArray:
    """Return the walls (4, 4) of a square."""
    h = 0.5 * width_m
    return np.array([[-h, -h, h, -h], [h, -h, h, h], [h, h, -h, h], [-h, h, -h, -h]])


class Bodies:
    """A space with poses and wheel speeds, stepped in one of two ways."""

    def __init__(
        self,
        poses: FloatArray,
        width_m: float,
        *,
        from_python: bool = False,
        walls: FloatArray | None = None,
        pillars: FloatArray | None = None,
    ) -> None:
        borders = box(width_m) if walls is None else np.vstack([box(width_m), walls])
        none = np.zeros((0, 3))
        self.space = Space(
            len(poses), RADIUS_M, MASS_KG, borders, none if pillars is None else pillars, STEP_S
        )
        self.poses = np.array(poses, dtype=float)
        self.velocities = np.zeros_like(self.poses)
        self.wheel_speeds = np.zeros((len(poses), 2))
        self.from_python = from_python

    def step(self, times: int = 1) -> None:
        physics = self.space.physics
        for _ in range(times):
            write_commands(physics, self.poses, self.wheel_speeds, TRACK_M, STEP_S)
            if self.from_python:
                self.space.step_from_python(STEP_S)
            else:
                step_physics(physics, STEP_S)
            read_states(physics, self.poses, self.velocities, self.wheel_speeds, TRACK_M, STEP_S)

    def gaps_m(self) -> FloatArray:
        """Return the distances between all hulls; negative where they overlap."""
        x, y = self.poses[:, 0], self.poses[:, 1]
        pairs = np.triu_indices(len(self.poses), 1)
        away = np.hypot(x[:, None] - x, y[:, None] - y)
        return np.asarray(away[pairs] - 2.0 * RADIUS_M)


def crowd(robots: int, width_m: float, seed: int) -> FloatArray:
    """Return poses on a grid, without overlaps."""
    rng = np.random.default_rng(seed)
    side = int(np.ceil(np.sqrt(robots)))
    places = np.linspace(-0.5 * width_m + 0.15, 0.5 * width_m - 0.15, side)
    grid = np.array([(x, y) for x in places for y in places])[:robots]
    return np.column_stack([grid, rng.uniform(-np.pi, np.pi, robots)])


def set_random_wheel_speeds(bodies: Bodies, rng: np.random.Generator) -> None:
    """Set wheel speeds that are forwards more often than backwards."""
    bodies.wheel_speeds[:] = rng.uniform(-0.2, 0.4, bodies.wheel_speeds.shape)


def test_compiled_steps_are_pymunks_own_steps() -> None:
    """Bit for bit, in a crowd of robots that push one another, over 400 steps."""
    poses = crowd(16, 1.4, 1)
    compiled, python = Bodies(poses, 1.4), Bodies(poses, 1.4, from_python=True)
    rng = np.random.default_rng(2)
    touched = False
    for _ in range(400):
        set_random_wheel_speeds(compiled, rng)
        python.wheel_speeds[:] = compiled.wheel_speeds
        compiled.step()
        python.step()
        assert np.array_equal(compiled.poses, python.poses)
        assert np.array_equal(compiled.velocities, python.velocities)
        touched = touched or compiled.gaps_m().min() < 0.001
    assert touched


def test_the_next_poses_depend_on_poses_and_wheel_speeds_alone() -> None:
    """A new space with the poses of a crowd does the same next step as the old one, bit for bit."""
    bodies = Bodies(crowd(25, 1.5, 3), 1.5)
    rng = np.random.default_rng(4)
    for _ in range(60):
        set_random_wheel_speeds(bodies, rng)
        bodies.step(3)
        new = Bodies(bodies.poses, 1.5)
        new.wheel_speeds[:] = bodies.wheel_speeds
        expected = bodies.poses.copy()
        bodies.step()
        new.step()
        assert np.array_equal(new.poses, bodies.poses)
        assert not np.array_equal(expected, bodies.poses)


@pytest.mark.parametrize(("left", "right"), [(0.3, 0.3), (0.1, 0.3), (-0.2, 0.2), (0.0, -0.3)])
def test_a_free_robot_follows_its_arc(left: float, right: float) -> None:
    """After a second it is where the geometry of two wheels says, up to the chord of one step."""
    bodies = Bodies(np.array([[0.0, 0.0, 0.5]]), 20.0)
    bodies.wheel_speeds[0] = left, right
    bodies.step(5)
    speed, turn = 0.5 * (left + right), (right - left) / TRACK_M
    if turn == 0.0:
        expected = np.array([speed * np.cos(0.5), speed * np.sin(0.5)])
    else:
        radius = speed / turn
        angles = 0.5 + turn
        expected = radius * np.array([np.sin(angles) - np.sin(0.5), np.cos(0.5) - np.cos(angles)])
    chord = 1.0 if turn == 0.0 else np.sinc(0.5 * turn * STEP_S / np.pi)
    assert np.hypot(*expected) == pytest.approx(chord * np.hypot(*bodies.poses[0, :2]), abs=1e-3)
    assert (
        np.arctan2(*(bodies.poses[0, 1::-1] - 0.0))
        == pytest.approx(np.arctan2(expected[1], expected[0]), abs=1e-6)
        or np.hypot(*expected) < 1e-9
    )
    heading = (0.5 + turn + np.pi) % (2.0 * np.pi) - np.pi
    assert bodies.poses[0, 2] == pytest.approx(heading, abs=1e-9)
    assert bodies.velocities[0, 2] == pytest.approx(turn)
    assert np.hypot(*bodies.velocities[0, :2]) == pytest.approx(abs(speed))


def test_a_robot_whose_wheels_stop_stops() -> None:
    """There is no momentum: its wheels grip the ground."""
    bodies = Bodies(np.array([[0.0, 0.0, 0.0]]), 5.0)
    bodies.wheel_speeds[0] = 0.3, 0.3
    bodies.step()
    before = bodies.poses.copy()
    bodies.wheel_speeds[:] = 0.0
    bodies.step(10)
    assert np.array_equal(bodies.poses, before)
    assert not bodies.velocities.any()


def test_walls_and_pillars_stop_robots() -> None:
    """A robot enters an obstacle by one step at most, is pushed out, and stops."""
    inner = np.array([[1.0, -1.0, 1.0, 1.0]])
    pillar = np.array([[-1.0, 0.0, 0.3]])
    poses = np.array([[0.0, 0.05, 0.0], [0.0, -0.3, np.pi], [0.0, 1.5, 0.5 * np.pi]])
    bodies = Bodies(poses, 4.0, walls=inner, pillars=pillar)
    bodies.wheel_speeds[:] = 0.3
    hull_m = RADIUS_M - 0.3 * STEP_S
    for _ in range(60):
        bodies.step()
        assert bodies.poses[0, 0] < 1.0 - hull_m
        assert np.hypot(*(bodies.poses[1, :2] - pillar[0, :2])) > 0.3 + hull_m
        assert bodies.poses[2, 1] < 2.0 - hull_m
    assert bodies.poses[0, 0] == pytest.approx(1.0 - RADIUS_M, abs=0.01)
    assert bodies.poses[2, 1] == pytest.approx(2.0 - RADIUS_M, abs=0.01)


def test_a_crowd_stays_inside_and_apart() -> None:
    """Thirty robots with random wheel speeds overlap by no more than two robots move in a step, and
    stay inside."""
    bodies = Bodies(crowd(30, 1.8, 5), 1.8)
    rng = np.random.default_rng(6)
    deepest_m, out_m = 0.0, 0.0
    for _ in range(500):
        bodies.wheel_speeds[:] = rng.uniform(-0.3, 0.3, bodies.wheel_speeds.shape)
        bodies.step()
        deepest_m = max(deepest_m, -float(bodies.gaps_m().min()))
        out_m = max(out_m, float(np.abs(bodies.poses[:, :2]).max()) - (0.9 - RADIUS_M))
    assert deepest_m < 2.0 * 0.3 * STEP_S
    assert out_m < 0.3 * STEP_S
    bodies.wheel_speeds[:] = 0.0
    bodies.step(20)
    assert bodies.gaps_m().min() > -0.005


def test_two_robots_that_overlap_are_pushed_apart() -> None:
    """Nearly all of an overlap is gone after a few steps."""
    bodies = Bodies(np.array([[0.0, 0.0, 0.0], [0.05, 0.01, 1.0]]), 3.0)
    bodies.step(4)
    assert bodies.gaps_m().min() > -0.005


def test_one_robot_pushes_another() -> None:
    """A robot that stands still is moved by one that drives against it, and slows that down."""
    bodies = Bodies(np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]]), 6.0)
    bodies.wheel_speeds[0] = 0.3
    bodies.step(30)
    assert bodies.poses[1, 0] > 0.4
    assert bodies.poses[0, 0] < 0.3 * 30 * STEP_S - 0.2


def test_headings_stay_within_one_turn() -> None:
    """A robot that turns for long has a heading in (-pi, pi]."""
    bodies = Bodies(np.array([[0.0, 0.0, 3.0]]), 3.0)
    bodies.wheel_speeds[0] = -0.2, 0.2
    for _ in range(100):
        bodies.step()
        assert -np.pi < bodies.poses[0, 2] <= np.pi
