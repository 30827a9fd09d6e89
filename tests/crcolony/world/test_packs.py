"""Jaws latch on packs in reach, take their charge, and an emptied pack is replaced elsewhere."""

import math

import numpy as np
import pytest

from crcolony.body import contract
from crcolony.world.arena import Arena
from tests.support.small_arenas import new_arena, put


def charge_of(arena: Arena, robot: int = 0, jaw: float = 1.0) -> float:
    """Simulate a tick in which a robot stands still with its jaw closed or open; return its
    charge."""
    action = np.zeros(contract.ACTION_WIDTH)
    action[contract.JAW], action[contract.TTL] = jaw, 1.0
    arena.act(robot, action)
    arena.integrate()
    return float(arena.world.charges[robot])


@pytest.mark.parametrize(
    ("distance_m", "bearing_deg", "taken"),
    [(0.17, 0, True), (0.17, 29, True), (0.17, -29, True), (0.17, 31, False), (0.19, 0, False)],
)
def test_a_jaw_has_a_reach(distance_m: float, bearing_deg: float, taken: bool) -> None:
    """It is 18 cm and 30 degrees to each side."""
    arena = new_arena()
    bearing = math.radians(bearing_deg)
    put(
        arena,
        [(0.0, 0.0, 0.5)],
        [(distance_m * math.cos(0.5 + bearing), distance_m * math.sin(0.5 + bearing))],
    )
    assert (charge_of(arena) == 0.4) == taken


def test_an_open_jaw_does_not_latch() -> None:
    """The robot has to close it."""
    arena = new_arena()
    put(arena, [(0.0, 0.0, 0.0)], [(0.15, 0.0)])
    assert charge_of(arena, jaw=0.0) == 0.0
    assert charge_of(arena) == 0.4


def test_an_empty_pack_is_replaced_at_a_clear_position() -> None:
    """In the same tick, by a full one away from walls, robots and other packs."""
    arena = new_arena(3, packs=4, width_m=4.0)
    positions = [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0)]
    for _ in range(30):
        put(arena, [(0.0, 0.0, 0.0), (0.7, 0.7, 0.0), (-0.7, -0.7, 0.0)], [(0.15, 0.0), *positions])
        assert charge_of(arena) == 0.4
        world = arena.world
        assert (world.pack_charges[0], world.pack_holders[0], world.holding[0]) == (0.4, -1, -1)
        assert (np.abs(world.packs[0]) <= 1.8).all()
        for other in [*world.poses[:, :2], *world.packs[1:]]:
            assert math.hypot(*(world.packs[0] - other)) > 0.3


def test_a_held_pack_moves_with_its_holder() -> None:
    """No other robot sees it or latches on it until it is released or empty."""
    arena = new_arena(2, packs=1, arena={"pack_charge_per_step": 0.1})
    put(arena, [(0.0, 0.0, 0.0), (0.3, 0.0, math.pi)], [(0.15, 0.0)])
    assert charge_of(arena) == pytest.approx(0.1)
    world = arena.world
    assert (world.holding[0], world.pack_holders[0]) == (0, 0)
    assert world.packs[0] == pytest.approx(world.poses[0, :2] + [0.13, 0.0])
    assert charge_of(arena, 1) == 0.0
    assert arena.observe()[1, contract.PACK] == 0.0
    assert arena.observe()[0, contract.JAW_HOLDS] == 1.0
    charge_of(arena, 1, jaw=0.0)
    assert charge_of(arena, jaw=0.0) == 0.0
    assert (world.holding[0], world.pack_holders[0]) == (-1, -1)
    assert arena.observe()[1, contract.PACK] == 1.0
    left = world.pack_charges[0]
    taken = [charge_of(arena) for _ in range(round(left / 0.1))]
    assert sum(taken) == pytest.approx(left)
    assert world.holding[0] == -1
    assert world.pack_charges[0] == 0.4


def test_a_jaw_takes_the_nearest_of_several_packs_and_one_at_a_time() -> None:
    """The other packs stay where they are."""
    arena = new_arena(packs=3, arena={"pack_charge_per_step": 0.05})
    put(arena, [(0.0, 0.0, 0.0)], [(0.17, 0.02), (0.14, -0.01), (0.16, 0.0)])
    charge_of(arena)
    assert arena.world.holding[0] == 1
    charge_of(arena)
    assert arena.world.pack_holders.tolist() == [-1, 0, -1]


def test_a_pack_charges_the_bodys_own_battery() -> None:
    """That battery runs down, and stays between 0 and 1."""
    arena = new_arena(body={"battery_drain_per_s": 0.25})
    put(arena, [(0.0, 0.0, 0.0)])
    levels = []
    for _ in range(25):
        charge_of(arena)
        levels.append(float(arena.observe()[0, contract.BATTERY]))
    assert levels[:3] == pytest.approx([0.95, 0.9, 0.85])
    assert levels[-1] == 0.0
    put(arena, [(0.0, 0.0, 0.0)], [(0.15, 0.0)])
    charge_of(arena)
    row = arena.observe()[0]
    assert row[contract.CHARGE] == 0.4
    assert row[contract.BATTERY] == pytest.approx(0.35)
