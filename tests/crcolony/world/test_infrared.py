"""Infrared rays meet what pymunk's own rays meet."""

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
    row = arena.observe()[0]
    return float(row[contract.IR_RANGE]), row[contract.PROXIMITY : contract.PROXIMITY + 7].tolist()


def test_where_nothing_is_a_sensor_reads_its_range() -> None:
    """Ahead a metre, around the front 30 cm, from the hull on."""
    arena = new_arena(width_m=10.0, body=INFRARED)
    put(arena, [(0.0, 0.0, 1.0)])
    ahead, around = sensed(arena)
    assert ahead == pytest.approx(1.0)
    assert around == pytest.approx([0.3] * 7)


def test_walls_and_bodies_are_felt_from_the_hull_on() -> None:
    """A wall ahead, and a robot on the left at which the leftmost sensor looks."""
    arena = new_arena(2, width_m=4.0, body=INFRARED)
    put(arena, [(1.6, 0.0, 0.0), (1.6, 0.4, 0.0)])
    ahead, around = sensed(arena)
    assert ahead == pytest.approx(0.4 - RADIUS_M)
    assert around[3] == pytest.approx(0.4 - RADIUS_M)
    assert around[6] == pytest.approx(0.4 - 2 * RADIUS_M)
    assert around[0] == pytest.approx(0.3)


@given(st.integers(0, 2**32))
def test_rays_end_where_pymunks_ray_casts_end(seed: int) -> None:
    """In random places with walls, pillars and a crowd: the segment query of pymunk is the oracle."""
    rng = np.random.default_rng(seed)
    walls = rng.uniform(-1.0, 1.0, (2, 4))
    pillars = np.column_stack([rng.uniform(-1.0, 1.0, (2, 2)), rng.uniform(0.05, 0.2, 2)])
    obstacles = {
        "inner_walls": tuple(map(tuple, walls.tolist())),
        "pillars": tuple(map(tuple, pillars.tolist())),
    }
    arena = new_arena(6, width_m=3.0, arena=obstacles, body=INFRARED)
    poses = np.column_stack([rng.uniform(-1.3, 1.3, (6, 2)), rng.uniform(-3, 3, 6)])
    place = poses[0, :2]
    if np.hypot(*(poses[1:, :2] - place).T).min() < RADIUS_M + 1e-3:
        return
    if (np.hypot(*(pillars[:, :2] - place).T) < pillars[:, 2] + 1e-3).any():
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
        way = np.array([math.cos(poses[0, 2] + angle), math.sin(poses[0, 2] + angle)])
        end = place + (RADIUS_M + range_m) * way
        hit = space.segment_query_first(tuple(place), tuple(end), 0.0, pymunk.ShapeFilter())
        share = 1.0 if hit is None else hit.alpha
        return max(share * (RADIUS_M + range_m) - RADIUS_M, 0.0)

    expected = [cast(math.pi * (k / 6 - 0.5), 0.3) for k in range(7)]
    ahead, around = sensed(arena)
    assert ahead == pytest.approx(cast(0.0, 1.0), abs=1e-6)
    assert around == pytest.approx(expected, abs=1e-6)


def test_switched_off_they_read_nothing() -> None:
    """And cost nothing: no ray is cast."""
    arena = new_arena(width_m=0.6)
    put(arena, [(0.0, 0.0, 0.0)])
    assert sensed(arena) == (0.0, [0.0] * 7)
