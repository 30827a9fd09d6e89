"""An arena is saved and restored whole, has room for everybody who comes and goes, and refuses what does not fit."""

from collections.abc import Mapping

import msgspec
import numpy as np
import pytest

from crcolony.body import contract
from crcolony.body.contract_test import random_action
from crcolony.body.settings import CyberRodent, Noise
from crcolony.world.arena import Arena
from crcolony.world.arena_size import check_fit, pack_count, size_m
from crcolony.world.encounter_detection import detect_encounters
from crcolony.world.settings import ArenaSettings
from tests.support.small_arenas import new_arena, put

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
            arena.act(robot, random_action(rng))
        arena.integrate()
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
    assert first[:, :, contract.JAW_HOLDS].any()
    one.restore(saved)
    assert np.array_equal(live(one, 100, np.random.default_rng(4)), first)


def empty_arena(robots: int, seed: int = 1, senses: Mapping[str, object] | None = None) -> Arena:
    """Return a small arena in the reflex world, where nobody has a body yet."""
    settings = ArenaSettings(width_m=1.6, packs=6, pack_charge_per_step=0.1, wall_turn_rad=0.5)
    return Arena(robots, settings, msgspec.convert(senses or {}, CyberRodent), seed, embodied=False)


def test_embodying_everybody_at_the_start_is_an_arena_with_everybody() -> None:
    """In whatever order they come, every field of the world is the same, and so is the future, bit for bit."""
    whole = new_arena(
        6,
        packs=6,
        width_m=1.6,
        arena={"pack_charge_per_step": 0.1, "wall_turn_rad": 0.5},
        body=EVERYTHING,
    )
    filled = empty_arena(6, senses=EVERYTHING)
    for slot in (3, 0, 5, 1, 2, 4):
        filled.embody(slot, 0)
    expected = live(whole, 200, np.random.default_rng(5))
    assert np.array_equal(live(filled, 200, np.random.default_rng(5)), expected)
    for one, other in zip(whole.save().values(), filled.save().values(), strict=True):
        assert np.array_equal(one, other)


def test_who_is_there_lives_as_if_the_other_places_did_not_exist() -> None:
    """With places that are empty, or empty again, two robots have the same future and draw the same numbers."""
    two = empty_arena(2, senses=EVERYTHING)
    five = empty_arena(5, senses=EVERYTHING)
    for arena in (two, five):
        arena.embody(0, 0)
        arena.embody(1, 0)
    five.embody(3, 0)
    five.remove(3)
    for name, value in two.save().items():
        if name in ("packs", "pack_charges", "pack_holders", "stream"):
            getattr(five.world, name)[...] = value
        else:
            field = getattr(five.world, name)
            among = (slice(None),) if name in ("pending", "observations") else ()
            field[(*among, slice(2))] = value
    five.update_cells()
    rng = [np.random.default_rng(6), np.random.default_rng(6)]
    for _ in range(300):
        for arena, asked in zip((two, five), rng, strict=True):
            for robot in (0, 1):
                arena.act(robot, random_action(asked))
            arena.integrate()
        assert np.array_equal(two.observe(), five.observe()[:2])
        assert np.array_equal(two.world.packs, five.world.packs)
    assert np.array_equal(two.world.stream, five.world.stream)


def test_an_absent_body_stands_still_far_away_whatever_it_is_told() -> None:
    """No command reaches it, it observes nothing, and nobody sees or meets it; no two of them are in one spot."""
    arena = empty_arena(4, senses={"microphones": True})
    arena.embody(1, 0)
    parked = arena.world.poses[[0, 2, 3]].copy()
    assert np.hypot(*parked[:, :2].T).min() > 1e4
    assert np.unique(parked, axis=0).shape == parked.shape
    live(arena, 50, np.random.default_rng(7))
    absent = [0, 2, 3]
    assert np.array_equal(arena.world.poses[absent], parked)
    assert not arena.world.actions[absent].any()
    assert not arena.observe()[absent].any()
    arena.world.actions[1, contract.SPEAKER] = 0.0
    seen = arena.observe()[1]
    assert not seen[contract.FACE : contract.IR_RANGE].any()
    assert not seen[contract.MICROPHONES : contract.MICROPHONES + 2].any()
    assert arena.world.partners.tolist() == [-1, -1, -1, -1]


def test_a_body_appears_at_home_or_where_there_is_room() -> None:
    """Home is where the seed scattered it; somebody standing there sends it to a random place that is free."""
    homes = new_arena(4, width_m=1.6, packs=6).world.poses
    arena = empty_arena(4)
    arena.embody(2, 0)
    assert np.array_equal(arena.world.poses[2], homes[2])
    arena.world.poses[2, :2] = homes[1, :2] + 0.05
    before = arena.world.stream.copy()
    arena.embody(1, 0)
    assert not np.array_equal(arena.world.stream, before)
    assert np.hypot(*(arena.world.poses[1] - arena.world.poses[2])[:2]) >= 0.22
    assert (np.abs(arena.world.poses[1, :2]) <= 0.8 - 0.11).all()


def test_a_place_has_one_body_and_a_full_arena_takes_no_more() -> None:
    """Both are said by name, and change nothing."""
    arena = empty_arena(2)
    arena.embody(0, 0)
    with pytest.raises(ValueError, match="slot 0"):
        arena.embody(0, 1)
    assert arena.world.colonies.tolist() == [0, -1]
    crowd = Arena(2, ArenaSettings(width_m=0.5, packs=1), CyberRodent(), 1, embodied=False)
    crowd.embody(0, 0)
    crowd.world.poses[0, :2] = 0.0
    with pytest.raises(ValueError, match="no free place"):
        crowd.embody(1, 0)
    assert crowd.world.colonies.tolist() == [0, -1]


def test_a_removed_body_leaves_its_pack_behind_and_comes_back_fresh() -> None:
    """Battery, jaw, wheels, what it was told and what it saw are those of a new one."""
    arena = empty_arena(2, senses={**EVERYTHING, "observation_latency_steps": 0})
    fresh = arena.save()
    arena.embody(0, 0)
    arena.embody(1, 1)
    put(arena, [(0.0, 0.0, 0.0), (0.5, 0.5, 0.0)], [(0.15, 0.0)])
    asked = np.zeros(contract.ACTION_WIDTH)
    asked[[contract.JAW, contract.TTL]] = 1.0
    for _ in range(2):
        arena.act(0, asked)
        arena.integrate()
        arena.observe()
    assert arena.world.pack_holders[0] == 0
    arena.remove(0)
    assert arena.world.pack_holders[0] == -1
    assert arena.world.colonies.tolist() == [-1, 1]
    for name in set(fresh) - {"packs", "pack_charges", "pack_holders", "stream", "headings"}:
        axis = 1 if name in ("pending", "observations") else 0
        now = getattr(arena.world, name)
        assert np.array_equal(now.take(0, axis), fresh[name].take(0, axis)), name
    arena.embody(0, 1)
    arena.integrate()
    assert arena.observe()[0, [contract.JAW_HOLDS, contract.BATTERY]].tolist() == [0.0, 1.0 - 0.002]


def test_nobody_hears_of_an_encounter_with_a_body_that_was_removed() -> None:
    """Not even later, where observations have a latency: somebody else may be in its place by then."""
    arena = empty_arena(3, senses={"observation_latency_steps": 2})
    for slot in range(3):
        arena.embody(slot, 0)
    put(arena, [(0.0, 0.0, 0.0), (0.4, 0.0, np.pi), (-0.6, -0.6, 0.0)])
    arena.world.actions[:, contract.BEACON] = 1.0
    detect_encounters(arena.world)
    arena.observe()
    assert arena.world.observations[0, 0, contract.ENCOUNTER_ROBOT] == 1.0
    arena.remove(1)
    assert arena.world.partners[0] == -1
    for _ in range(3):
        row = arena.observe()[0]
        assert row[[contract.ENCOUNTER, contract.ENCOUNTER_NONCE]].tolist() == [0.0, 0.0]


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
