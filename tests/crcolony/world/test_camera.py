"""The camera sees the nearest blob of each kind that is in range, in view, and not hidden."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crcolony.body import contract
from crcolony.compiled import FloatArray
from crcolony.world.arena import Arena
from tests.support.small_arenas import new_arena, put

HALF_ANGLE = math.radians(75)


def seen(arena: Arena, robot: int, blob: int) -> tuple[float, float] | None:
    """Return distance (m) and bearing (rad) of a blob, or None if it is not visible."""
    row = arena.observe()[robot]
    if row[blob] == 0.0:
        assert not row[blob : blob + 6].any()
        return None
    return float(row[blob + contract.DISTANCE]), float(row[blob + contract.BEARING])


@given(st.floats(-math.pi, math.pi), st.floats(0.3, 2.0), st.floats(-math.pi, math.pi))
def test_a_pack_is_visible_within_range_and_angle_only(
    heading: float, distance_m: float, bearing: float
) -> None:
    """It has its true distance and bearing, positive to the left, whatever the robot's heading."""
    if abs(distance_m - 1.5) < 1e-6 or abs(abs(bearing) - HALF_ANGLE) < 1e-6:
        return
    arena = new_arena()
    x, y = distance_m * math.cos(heading + bearing), distance_m * math.sin(heading + bearing)
    put(arena, [(0.0, 0.0, heading)], [(x, y)])
    blob = seen(arena, 0, contract.PACK)
    if distance_m > 1.5 or abs(bearing) > HALF_ANGLE:
        assert blob is None
    else:
        assert blob == pytest.approx((distance_m, bearing), abs=1e-9)


def test_a_robot_beyond_the_range_is_invisible_though_it_can_be_heard() -> None:
    """Microphones that reach further than the camera do not make it see further."""
    arena = new_arena(2, width_m=8.0, body={"microphones": True, "hearing_range_m": 3.0})
    for distance_m, visible in ((1.4, True), (2.0, False)):
        put(arena, [(0.0, 0.0, 0.0), (distance_m, 0.0, math.pi)])
        assert (seen(arena, 0, contract.FACE) is not None) == visible


def test_the_nearest_pack_is_visible_with_its_colour() -> None:
    """Packs that are further away, or held by a jaw, are not."""
    arena = new_arena(packs=3)
    put(arena, [(0.0, 0.0, 0.0)], [(1.0, 0.0), (0.5, 0.3), (0.3, 0.0)])
    arena.world.pack_holders[2] = 0
    assert seen(arena, 0, contract.PACK) == pytest.approx(
        (math.hypot(0.5, 0.3), math.atan2(0.3, 0.5))
    )
    row = arena.observe()[0]
    colour = contract.PACK + contract.COLOUR
    assert row[colour : colour + 3].tolist() == arena.world.pack_colours[1].tolist()


@pytest.mark.parametrize(
    ("heading_deg", "face"), [(180, True), (110, True), (-91, True), (80, False), (0, False)]
)
def test_a_robot_shows_its_face_or_its_tail_lamp(heading_deg: float, face: bool) -> None:
    """A face is visible from within 90 degrees of its heading, the tail from elsewhere, and never
    both."""
    arena = new_arena(2)
    put(arena, [(0.0, 0.0, 0.0), (0.8, 0.2, math.radians(heading_deg))])
    shown, hidden = (contract.FACE, contract.TAIL) if face else (contract.TAIL, contract.FACE)
    assert seen(arena, 0, shown) == pytest.approx((math.hypot(0.8, 0.2), math.atan2(0.2, 0.8)))
    assert seen(arena, 0, hidden) is None


def test_a_face_has_the_colour_of_its_lamp_and_a_tail_is_red() -> None:
    """The colour of a face is that of the other robot's action."""
    arena = new_arena(2)
    put(arena, [(0.0, 0.0, 0.0), (0.8, 0.0, math.pi)])
    arena.world.actions[1, contract.LED : contract.LED + 3] = [0.2, 0.7, 0.1]
    colour = slice(contract.FACE + contract.COLOUR, contract.FACE + contract.COLOUR + 3)
    assert arena.observe()[0, colour].tolist() == [0.2, 0.7, 0.1]
    put(arena, [(0.0, 0.0, 0.0), (0.8, 0.0, 0.0)])
    colour = slice(contract.TAIL + contract.COLOUR, contract.TAIL + contract.COLOUR + 3)
    assert arena.observe()[0, colour].tolist() == [1.0, 0.0, 0.0]


def test_the_nearest_face_and_the_nearest_tail_of_several_are_visible() -> None:
    """Each in its own blob."""
    arena = new_arena(5)
    put(
        arena,
        [
            (0.0, 0.0, 0.0),
            (1.2, 0.4, math.pi),
            (0.7, 0.4, math.pi),
            (0.6, -0.4, 0.0),
            (1.2, -0.5, 0.0),
        ],
    )
    assert seen(arena, 0, contract.FACE) == pytest.approx(
        (math.hypot(0.7, 0.4), math.atan2(0.4, 0.7))
    )
    assert seen(arena, 0, contract.TAIL) == pytest.approx(
        (math.hypot(0.6, 0.4), -math.atan2(0.4, 0.6))
    )


def hidden_by(**arena_settings: object) -> bool:
    """Return whether a pack a metre ahead is not visible."""
    arena = new_arena(arena=arena_settings)
    put(arena, [(0.0, 0.0, 0.0)], [(1.0, 0.0)])
    return seen(arena, 0, contract.PACK) is None


def test_walls_and_pillars_hide_what_is_behind_them() -> None:
    """Only if they are between robot and pack, and not beside or behind one of them."""
    assert not hidden_by()
    assert hidden_by(inner_walls=((0.5, -0.2, 0.5, 0.2),))
    assert not hidden_by(inner_walls=((0.5, 0.1, 0.5, 0.3),))
    assert not hidden_by(inner_walls=((1.2, -0.2, 1.2, 0.2),))
    assert not hidden_by(inner_walls=((-0.5, -0.2, -0.5, 0.2),))
    assert hidden_by(pillars=((0.5, 0.05, 0.1),))
    assert not hidden_by(pillars=((0.5, 0.15, 0.1),))
    assert not hidden_by(pillars=((1.3, 0.0, 0.1),))
    assert not hidden_by(pillars=((-0.5, 0.0, 0.3),))


def test_bodies_hide_packs_and_one_another() -> None:
    """A robot in between hides what is behind it, and is visible itself."""
    arena = new_arena(3)
    put(arena, [(0.0, 0.0, 0.0), (0.5, 0.05, 0.0), (1.0, 0.0, math.pi)], [(0.8, 0.0)])
    assert seen(arena, 0, contract.PACK) is None
    assert seen(arena, 0, contract.FACE) is None
    assert seen(arena, 0, contract.TAIL) is not None
    put(arena, [(0.0, 0.0, 0.0), (0.5, 0.2, 0.0), (1.0, 0.0, math.pi)], [(0.8, 0.0)])
    assert seen(arena, 0, contract.PACK) is not None
    assert seen(arena, 0, contract.FACE) is not None


def test_without_occlusion_everything_in_range_is_visible() -> None:
    """Occlusion is a setting."""
    arena = new_arena(3, body={"occlusion": False})
    put(arena, [(0.0, 0.0, 0.0), (0.5, 0.0, 0.0), (1.0, 0.0, math.pi)], [(0.8, 0.0)])
    assert seen(arena, 0, contract.PACK) is not None
    assert seen(arena, 0, contract.FACE) is not None


def crosses_disc(to: FloatArray, centre: FloatArray, radius: float) -> bool:
    """Return whether a point of the line from the origin, sampled in small steps, is in the
    disc."""
    line = np.linspace(0.0, 1.0, 4001)[:, None] * to
    return bool((np.hypot(*(line - centre).T) < radius).any())


@given(st.integers(0, 2**32))
def test_occlusion_is_that_of_a_sampled_ray(seed: int) -> None:
    """In random crowds, except where the ray only grazes a body."""
    rng = np.random.default_rng(seed)
    arena = new_arena(6)
    poses = np.column_stack([rng.uniform(-0.8, 0.8, (6, 2)), rng.uniform(-3, 3, 6)])
    pack = rng.uniform(-0.8, 0.8, 2)
    others = poses[1:, :2] - poses[0, :2]
    to = pack - poses[0, :2]
    if (np.hypot(*others.T) < 0.11).any() or np.hypot(*to) > 1.5:
        return
    poses[0, 2] = math.atan2(to[1], to[0])
    put(arena, poses, [pack])
    strictly = any(crosses_disc(to, centre, 0.11 - 1e-3) for centre in others)
    loosely = any(crosses_disc(to, centre, 0.11 + 1e-3) for centre in others)
    if strictly == loosely:
        assert (seen(arena, 0, contract.PACK) is None) == strictly
