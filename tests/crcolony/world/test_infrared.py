"""Infrared rays hit what pymunk's own rays hit."""

import math

import numpy as np
import pymunk
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crcolony.body import contract
from crcolony.world.arena import Arena
from tests.support.small_arenas import new_arena, put

INFRARED = {"infrared": True}
RADIUS_M = 0.11


def sensed(arena: Arena) -> tuple[float, list[float]]:
    """Return the range sensor and the proximity sensors of the first robot (m)."""
    row = arena.observe()[0]
    return float(row[contract.IR_RANGE]), row[contract.PROXIMITY : contract.PROXIMITY + 7].tolist()


def test_in_free_space_a_sensor_reads_its_range() -> None:
    """A metre ahead and 30 cm around the front, from the hull."""
    arena = new_arena(width_m=10.0, body=INFRARED)
    put(arena, [(0.0, 0.0, 1.0)])
    ahead, around = sensed(arena)
    assert ahead == pytest.approx(1.0)
    assert around == pytest.approx([0.3] * 7)


def test_distances_of_walls_and_bodies_are_measured_from_the_hull() -> None:
    """A wall is ahead, and a robot on the left in the direction of the leftmost sensor."""
    arena = new_arena(2, width_m=4.0, body=INFRARED)
    put(arena, [(1.6, 0.0, 0.0), (1.6, 0.4, 0.0)])
    ahead, around = sensed(arena)
    assert ahead == pytest.approx(0.4 - RADIUS_M)
    assert around[3] == pytest.approx(0.4 - RADIUS_M)
    assert around[6] == pytest.approx(0.4 - 2 * RADIUS_M)
    assert around[0] == pytest.approx(0.3)


@given(st.integers(0, 2**32))
def test_rays_end_where_pymunks_ray_casts_end(seed: int) -> None:
    """At random positions with walls, pillars and a crowd; the segment query of pymunk is the
    oracle."""
    rng = np.random.default_rng(seed)
    walls = rng.uniform(-1.0, 1.0, (2, 4))
    pillars = np.column_stack([rng.uniform(-1.0, 1.0, (2, 2)), rng.uniform(0.05, 0.2, 2)])
    obstacles = {
        "inner_walls": tuple(map(tuple, walls.tolist())),
        "pillars": tuple(map(tuple, pillars.tolist())),
    }
    arena = new_arena(6, width_m=3.0, arena=obstacles, body=INFRARED)
    poses = np.column_stack([rng.uniform(-1.3, 1.3, (6, 2)), rng.uniform(-3, 3, 6)])
    position = poses[0, :2]
    if np.hypot(*(poses[1:, :2] - position).T).min() < RADIUS_M + 1e-3:
        return
    if (np.hypot(*(pillars[:, :2] - position).T) < pillars[:, 2] + 1e-3).any():
        return
    put(arena, poses)
    space = pymunk.Space()
    outer = [(-1.5, -1.5), (1.5, -1.5), (1.5, 1.5), (-1.5, 1.5)]
    ends = [*zip(outer, outer[1:] + outer[:1], strict=True)]
    ends += [(tuple(wall[:2]), tuple(wall[2:])) for wall in walls.tolist()]
    for start, end in ends:
        space.add(pymunk.Segment(space.static_body, start, end, 0.0))
    for x, y, radius in pillars.tolist():
        space.add(pymunk.Circle(space.static_body, radius, (x, y)))
    for x, y, _ in poses[1:].tolist():
        space.add(pymunk.Circle(space.static_body, RADIUS_M, (x, y)))

    def cast(angle: float, range_m: float) -> float:
        direction = np.array([math.cos(poses[0, 2] + angle), math.sin(poses[0, 2] + angle)])
        end = position + (RADIUS_M + range_m) * direction
        hit = space.segment_query_first(tuple(position), tuple(end), 0.0, pymunk.ShapeFilter())
        share = 1.0 if hit is None else hit.alpha
        return max(share * (RADIUS_M + range_m) - RADIUS_M, 0.0)

    expected = [cast(math.pi * (k / 6 - 0.5), 0.3) for k in range(7)]
    ahead, around = sensed(arena)
    assert ahead == pytest.approx(cast(0.0, 1.0), abs=1e-6)
    assert around == pytest.approx(expected, abs=1e-6)


def test_sensors_that_are_off_read_0() -> None:
    """They are off by default."""
    arena = new_arena(width_m=0.6)
    put(arena, [(0.0, 0.0, 0.0)])
    assert sensed(arena) == (0.0, [0.0] * 7)
