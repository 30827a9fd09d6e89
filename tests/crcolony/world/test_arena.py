"""An arena is saved and restored whole, adds and removes bodies, and refuses what does not fit."""

from collections.abc import Mapping

import msgspec
import numpy as np
import pytest

from crcolony.body import contract
from crcolony.body.contract_test import random_action
from crcolony.body.settings import CyberRodent, Noise
from crcolony.world.arena import Arena
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


def run(arena: Arena, ticks: int, rng: np.random.Generator) -> np.ndarray:
    """Run an arena with random actions; return all observations, shape (ticks, N,
    OBSERVATION_WIDTH)."""
    rows = []
    for _ in range(ticks):
        for robot in range(arena.robots):
            arena.act(robot, random_action(rng))
        arena.integrate()
        rows.append(arena.observe().copy())
    return np.array(rows)


def test_a_restored_arena_has_the_same_future() -> None:
    """In a crowd, with every sense and latency on, bit for bit."""
    settings = {"pack_charge_per_step": 0.05, "wall_turn_rad": 0.5}
    one = new_arena(8, packs=6, width_m=1.2, seed=1, arena=settings, body=EVERYTHING)
    run(one, 100, np.random.default_rng(2))
    other = new_arena(8, packs=6, width_m=1.2, seed=77, arena=settings, body=EVERYTHING)
    run(other, 10, np.random.default_rng(3))
    saved = one.save()
    first = run(one, 100, np.random.default_rng(4))
    other.restore(saved)
    second = run(other, 100, np.random.default_rng(4))
    assert np.array_equal(first, second)
    assert np.array_equal(one.world.poses, other.world.poses)
    assert first[:, :, contract.JAW_HOLDS].any()
    one.restore(saved)
    assert np.array_equal(run(one, 100, np.random.default_rng(4)), first)


def empty_arena(robots: int, seed: int = 1, senses: Mapping[str, object] | None = None) -> Arena:
    """Return a small arena whose slots have no bodies yet; walls turn robots."""
    settings = ArenaSettings(width_m=1.6, packs=6, pack_charge_per_step=0.1, wall_turn_rad=0.5)
    return Arena(robots, settings, msgspec.convert(senses or {}, CyberRodent), seed, embodied=False)


def test_an_arena_whose_bodies_were_added_equals_one_that_had_them_from_the_start() -> None:
    """In whatever order they are added, every field of the world and its future are the same, bit
    for bit."""
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
    expected = run(whole, 200, np.random.default_rng(5))
    assert np.array_equal(run(filled, 200, np.random.default_rng(5)), expected)
    for one, other in zip(whole.save().values(), filled.save().values(), strict=True):
        assert np.array_equal(one, other)


def test_slots_without_a_body_change_nothing_for_the_others() -> None:
    """With slots that are empty, or empty again, two robots have the same future and draw the same
    numbers."""
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
            axes = (slice(None),) if name in ("pending", "observations") else ()
            field[(*axes, slice(2))] = value
    five.update_cells()
    rngs = [np.random.default_rng(6), np.random.default_rng(6)]
    for _ in range(300):
        for arena, rng in zip((two, five), rngs, strict=True):
            for robot in (0, 1):
                arena.act(robot, random_action(rng))
            arena.integrate()
        assert np.array_equal(two.observe(), five.observe()[:2])
        assert np.array_equal(two.world.packs, five.world.packs)
    assert np.array_equal(two.world.stream, five.world.stream)


def test_a_slot_without_a_body_does_not_move_or_observe() -> None:
    """No action reaches it, and no robot senses or encounters it; no two of them are at one
    position."""
    arena = empty_arena(4, senses={"microphones": True})
    arena.embody(1, 0)
    positions = arena.world.poses[[0, 2, 3]].copy()
    assert np.hypot(*positions[:, :2].T).min() > 1e4
    assert np.unique(positions, axis=0).shape == positions.shape
    run(arena, 50, np.random.default_rng(7))
    absent = [0, 2, 3]
    assert np.array_equal(arena.world.poses[absent], positions)
    assert not arena.world.actions[absent].any()
    assert not arena.observe()[absent].any()
    arena.world.actions[1, contract.SPEAKER] = 0.0
    observation = arena.observe()[1]
    assert not observation[contract.FACE : contract.IR_RANGE].any()
    assert not observation[contract.MICROPHONES : contract.MICROPHONES + 2].any()
    assert arena.world.partners.tolist() == [-1, -1, -1, -1]


def test_a_body_is_added_at_its_home_or_at_a_free_position() -> None:
    """Home is where the seed placed it; if another robot is there, it is a random position that is
    free."""
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


def test_a_second_body_in_a_slot_and_one_without_a_free_position_are_refused() -> None:
    """Both raise ValueError and change nothing."""
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


def test_a_removed_body_leaves_its_pack_behind_and_its_slot_like_a_new_one() -> None:
    """Battery, jaw, wheels, actions and observations are those of a new body."""
    arena = empty_arena(2, senses={**EVERYTHING, "observation_latency_steps": 0})
    fresh = arena.save()
    arena.embody(0, 0)
    arena.embody(1, 1)
    put(arena, [(0.0, 0.0, 0.0), (0.5, 0.5, 0.0)], [(0.15, 0.0)])
    action = np.zeros(contract.ACTION_WIDTH)
    action[[contract.JAW, contract.TTL]] = 1.0
    for _ in range(2):
        arena.act(0, action)
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


def test_an_encounter_with_a_removed_body_is_not_observed() -> None:
    """Not even after the observation latency: another robot may have the slot by then."""
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
    """The message names the field that does not fit."""
    with pytest.raises(ValueError, match="poses"):
        new_arena(2).restore(new_arena(3).save())
    with pytest.raises(ValueError, match="packs"):
        new_arena(2, packs=2).restore(new_arena(2, packs=3).save())
    saved = new_arena(2).save()
    del saved["stream"]
    with pytest.raises(ValueError, match="stream"):
        new_arena(2).restore(saved)


@pytest.mark.parametrize("seed", range(5))
def test_robots_and_packs_are_placed_inside_and_clear(seed: int) -> None:
    """No robot touches another, a wall or a pillar, and no pack is next to a robot."""
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


def test_the_seed_decides_where_everything_is_placed() -> None:
    """One seed gives the same positions, another one others."""
    one, same, other = (new_arena(4, seed=seed).world.poses for seed in (1, 1, 2))
    assert np.array_equal(one, same)
    assert not np.array_equal(one, other)


def test_noise_does_not_change_where_everything_is_placed() -> None:
    """It draws from the arena's stream only when robots observe."""
    noisy = new_arena(4, body={"noise": Noise(distance_m=0.1)})
    assert np.array_equal(noisy.world.poses, new_arena(4).world.poses)
