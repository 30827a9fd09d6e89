"""Robots encounter each other face to face, beacons on, in range and in line of sight."""

import math

import numpy as np
import pytest

from crcolony.body import contract
from crcolony.world.arena import Arena
from crcolony.world.encounter_detection import detect_encounters
from tests.support.small_arenas import new_arena, put

FACING = [(0.0, 0.0, 0.0), (0.4, 0.0, math.pi)]


def partners(arena: Arena, beacons: list[float] | None = None) -> list[int]:
    """Return the partner of every robot, or -1, with these beacons (all on by default)."""
    arena.world.actions[:, contract.BEACON] = 1.0 if beacons is None else beacons
    detect_encounters(arena.world)
    return [int(partner) for partner in arena.world.partners]


def test_two_robots_that_face_each_other_in_range_encounter_each_other() -> None:
    """Both observe the other's slot, and the same new nonce of 48 bits, exactly."""
    arena = new_arena(2)
    put(arena, FACING)
    nonces = set()
    for _ in range(200):
        assert partners(arena) == [1, 0]
        one, two = arena.observe()
        assert (one[contract.ENCOUNTER], one[contract.ENCOUNTER_ROBOT]) == (1.0, 1.0)
        assert (two[contract.ENCOUNTER], two[contract.ENCOUNTER_ROBOT]) == (1.0, 0.0)
        assert one[contract.ENCOUNTER_NONCE] == two[contract.ENCOUNTER_NONCE]
        assert 0 <= one[contract.ENCOUNTER_NONCE] < 2**48
        assert one[contract.ENCOUNTER_NONCE] == int(one[contract.ENCOUNTER_NONCE])
        nonces.add(one[contract.ENCOUNTER_NONCE])
    assert len(nonces) == 200


@pytest.mark.parametrize(
    ("pose", "met"),
    [
        ((0.44, 0.0, math.pi), True),
        ((0.46, 0.0, math.pi), False),
        ((0.4, 0.0, math.pi - math.radians(29)), True),
        ((0.4, 0.0, math.pi - math.radians(31)), False),
        ((0.4 * math.cos(0.5), 0.4 * math.sin(0.5), math.pi + 0.5), True),
        ((0.4 * math.cos(0.55), 0.4 * math.sin(0.55), math.pi + 0.55), False),
        ((0.4, 0.0, 0.0), False),
        ((-0.4, 0.0, 0.0), False),
    ],
)
def test_range_and_both_facings_decide(pose: tuple[float, float, float], met: bool) -> None:
    """They are within 45 cm, and each within 30 degrees of the other's heading."""
    arena = new_arena(2)
    put(arena, [(0.0, 0.0, 0.0), pose])
    assert partners(arena) == ([1, 0] if met else [-1, -1])


@pytest.mark.parametrize("beacons", [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]])
def test_without_both_beacons_there_is_none(beacons: list[float]) -> None:
    """A robot that is not ready to mate has no encounter, and neither has the other."""
    arena = new_arena(2)
    put(arena, FACING)
    assert partners(arena, beacons) == [-1, -1]
    rows = arena.observe()
    assert not rows[:, [contract.ENCOUNTER, contract.ENCOUNTER_NONCE]].any()
    assert (rows[:, contract.ENCOUNTER_ROBOT] == -1.0).all()


def test_robots_of_two_colonies_have_no_encounter() -> None:
    """Each sees the other, but encounters one of its own colony, though that is further away."""
    arena = new_arena(3, body={"encounter_half_angle_rad": math.pi})
    put(arena, [(0.0, 0.0, 0.0), (0.25, 0.0, math.pi), (0.0, 0.4, 0.0)])
    arena.world.colonies[:] = [0, 1, 0]
    assert partners(arena) == [2, -1, 0]
    assert arena.observe()[0, contract.FACE] == 1.0
    arena.world.colonies[:] = 1
    assert partners(arena) == [1, 0, -1]


def test_a_wall_or_a_body_in_between_prevents_it() -> None:
    """An encounter needs a line of sight."""
    arena = new_arena(2, arena={"inner_walls": ((0.2, -0.3, 0.2, 0.3),)})
    put(arena, FACING)
    assert partners(arena) == [-1, -1]
    arena = new_arena(3, body={"radius_m": 0.05})
    put(arena, [*FACING, (0.2, 0.02, 0.5 * math.pi)])
    assert partners(arena, [1.0, 1.0, 0.0]) == [-1, -1, -1]
    put(arena, [*FACING, (0.2, 0.2, 0.5 * math.pi)])
    assert partners(arena, [1.0, 1.0, 0.0]) == [1, 0, -1]


def test_a_robot_encounters_at_most_one_and_the_nearest_pair_comes_first() -> None:
    """Of three robots around one it is the nearest; the others may encounter each other."""
    arena = new_arena(4, body={"encounter_half_angle_rad": math.pi})
    put(arena, [(0.0, 0.0, 0.0), (0.4, 0.0, 0.0), (-0.3, 0.0, 0.0), (0.4, 0.35, 0.0)])
    assert partners(arena) == [2, 3, 0, 1]
    assert len(set(arena.world.nonces)) == 2


def test_at_equal_distances_the_smaller_index_comes_first() -> None:
    """So the result does not depend on the machine."""
    arena = new_arena(3, body={"encounter_half_angle_rad": math.pi})
    put(arena, [(0.0, 0.0, 0.0), (0.4, 0.0, 0.0), (-0.4, 0.0, 0.0)])
    assert partners(arena) == [1, 0, -1]


def test_a_crowd_is_matched_as_by_brute_force() -> None:
    """Sixty robots without a limit of bearing: pairs by distance, greedily, each robot once."""
    arena = new_arena(60, width_m=4.0, body={"encounter_half_angle_rad": math.pi})
    poses = arena.world.poses.copy()
    put(arena, poses)
    expected = [-1] * 60
    offsets = poses[:, None, :2] - poses[None, :, :2]
    distances = np.hypot(offsets[..., 0], offsets[..., 1])
    pairs = sorted((distances[i, j], i, j) for i in range(60) for j in range(i + 1, 60))

    def is_hidden(i: int, j: int) -> bool:
        line = poses[j, :2] - poses[i, :2]
        for k in set(range(60)) - {i, j}:
            to = poses[k, :2] - poses[i, :2]
            share = np.clip(to @ line / (line @ line), 0.0, 1.0)
            if to @ line > 0.0 and np.hypot(*(to - share * line)) < 0.11:
                return True
        return False

    for distance, i, j in pairs:
        if distance > 0.45:
            break
        if expected[i] < 0 and expected[j] < 0 and not is_hidden(i, j):
            expected[i], expected[j] = j, i
    assert partners(arena) == expected
    assert max(expected) > 0
