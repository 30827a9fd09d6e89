"""An arena is saved and restored whole, starts with room for everybody, and refuses what does not fit."""

import msgspec
import numpy as np
import pytest

from crcolony.world import body
from crcolony.world.arena import Arena
from crcolony.world.arena_size import check_fit, pack_count, size_m
from crcolony.world.settings import Arena as ArenaSettings
from crcolony.world.settings import CyberRodent, Noise
from tests.world.body_contract import action
from tests.world.places import new_arena

EVERYTHING = {
    "infrared": True,
    "inertial": True,
    "microphones": True,
    "noise": Noise(distance_m=0.01, bearing_rad=0.01, gyro_rad_s=0.1),
    "observation_latency_steps": 2,
    "action_latency_steps": 1,
    "battery_drain_per_s": 0.01,
}


def live(arena: Arena, ticks: int, rng: np.random.Generator) -> np.ndarray:
    rows = []
    for _ in range(ticks):
        for robot in range(arena.robots):
            arena.act(robot, action(rng))
        arena.advance()
        rows.append(arena.observe().copy())
    return np.array(rows)


def test_a_restored_arena_goes_on_bit_for_bit() -> None:
    """A new one that is given what another saved in a crush has the same future, with every sense and latency on."""
    settings = {"pack_charge_per_step": 0.05, "wall_turn_rad": 0.5}
    one = new_arena(8, packs=6, width_m=1.2, seed=1, arena=settings, body=EVERYTHING)
    live(one, 100, np.random.default_rng(2))
    other = new_arena(8, packs=6, width_m=1.2, seed=77, arena=settings, body=EVERYTHING)
    live(other, 10, np.random.default_rng(3))
    saved = one.save()
    first = live(one, 100, np.random.default_rng(4))
    other.restore(saved)
    second = live(other, 100, np.random.default_rng(4))
    assert np.array_equal(first, second)
    assert np.array_equal(one.world.poses, other.world.poses)
    assert first[:, :, body.JAW_HOLDS].any()
    one.restore(saved)
    assert np.array_equal(live(one, 100, np.random.default_rng(4)), first)


def test_a_world_saved_under_other_settings_is_refused() -> None:
    """The field that does not fit is named."""
    with pytest.raises(ValueError, match="poses"):
        new_arena(2).restore(new_arena(3).save())
    with pytest.raises(ValueError, match="packs"):
        new_arena(2, packs=2).restore(new_arena(2, packs=3).save())
    saved = new_arena(2).save()
    del saved["stream"]
    with pytest.raises(ValueError, match="stream"):
        new_arena(2).restore(saved)


@pytest.mark.parametrize("seed", range(5))
def test_robots_and_packs_start_inside_and_clear(seed: int) -> None:
    """No robot touches another, a wall or a pillar, and no pack lies at a robot's feet."""
    obstacles = {"pillars": ((0.5, 0.5, 0.3),), "inner_walls": ((-0.5, -1.0, -0.5, 1.0),)}
    arena = new_arena(12, packs=8, width_m=3.0, seed=seed, arena=obstacles)
    poses, packs = arena.world.poses, arena.world.packs
    away = np.hypot(*(poses[:, None, :2] - poses[None, :, :2]).transpose(2, 0, 1))
    assert away[np.triu_indices(12, 1)].min() >= 0.22
    assert (np.abs(poses[:, :2]) <= 1.5 - 0.11).all()
    assert (np.hypot(*(poses[:, :2] - 0.5).T) >= 0.41).all()
    beside = np.abs(poses[:, 1]) <= 1.0
    assert (np.abs(poses[beside, 0] + 0.5) >= 0.11).all()
    assert np.hypot(*(poses[:, None, :2] - packs[None]).transpose(2, 0, 1)).min() > 0.3
    assert (np.hypot(*(packs - 0.5).T) >= 0.3).all()


def test_seeds_make_different_places_and_one_seed_the_same() -> None:
    """Where everything starts is drawn from the arena's own stream."""
    one, same, other = (new_arena(4, seed=seed).world.poses for seed in (1, 1, 2))
    assert np.array_equal(one, same)
    assert not np.array_equal(one, other)


def test_an_arena_grows_with_the_colony_unless_its_size_is_set() -> None:
    """So does the number of packs."""
    arena = ArenaSettings()
    assert size_m(arena, 4) == pytest.approx((2.2, 2.2))
    assert size_m(arena, 100) == pytest.approx((11.0, 11.0))
    assert pack_count(arena, 4) == 8
    fixed = ArenaSettings(width_m=3.0, height_m=2.0, packs=5)
    assert size_m(fixed, 100) == (3.0, 2.0)
    assert pack_count(fixed, 100) == 5


@pytest.mark.parametrize(
    ("settings", "robots", "said"),
    [
        ({"width_m": 0.3}, 1, "arena.width_m"),
        ({"width_m": 3.0, "height_m": 0.4}, 1, "arena.width_m"),
        ({"width_m": 1.0}, 10, "robots: 10"),
        ({"packs": 2000}, 4, "arena.packs: 2000"),
        ({"pillars": ((0.0, 0.0, 2.0),)}, 4, "arena.pillars"),
    ],
)
def test_what_does_not_fit_is_refused_by_name(
    settings: dict[str, object], robots: int, said: str
) -> None:
    """Before anything is built."""
    arena = msgspec.convert(settings, ArenaSettings)
    with pytest.raises(ValueError, match=said):
        check_fit(arena, CyberRodent(), robots)
    with pytest.raises(ValueError, match=said):
        Arena(robots, arena, CyberRodent(), 1)


def test_the_robots_own_randomness_is_not_the_arenas() -> None:
    """Switching noise on leaves where packs and robots are placed unchanged until something is observed."""
    noisy = new_arena(4, body={"noise": Noise(distance_m=0.1)})
    assert np.array_equal(noisy.world.poses, new_arena(4).world.poses)
