"""The rare events of a robot: hand-over, mating, turnover; and its snapshots."""

import msgspec
import numpy as np
import pytest

from crcolony.evolution.implicit_selection import ImplicitSelection
from crcolony.evolution.reproduction import MatingOffer
from crcolony.evolution.time_sharing import EpsilonGreedyOrder
from crcolony.robot.robot import Robot
from crcolony.robot.state import ADDED, FORMER_NAMES, SLICE_OVER
from crcolony.robot.weight_rows import weights_by_tile
from tests.support.small_robots import DEFAULT, Settings, new_robots, random_observation

LIFE = DEFAULT.life


def step_until_slice_over(robot: Robot, rng: np.random.Generator) -> None:
    """Step a robot with random observations until the slice of its agent is over."""
    while True:
        robot.step(random_observation(rng))
        if robot.events & SLICE_OVER:
            return


def test_every_agent_has_its_slices_and_then_the_generation_is_over() -> None:
    """Hand-overs give each agent as many slices as set, and then return False."""
    _, _, (robot,) = new_robots(1)
    births = robot.start()
    assert len(births) == LIFE.agents
    rng = np.random.default_rng(1)
    turns = [robot.agent]
    while True:
        step_until_slice_over(robot, rng)
        if not robot.hand_over():
            break
        turns.append(robot.agent)
    assert sorted(turns) == sorted(list(range(LIFE.agents)) * LIFE.slices)
    assert robot.steps == len(turns) * LIFE.slice_steps


def test_new_agents_have_learnt_nothing() -> None:
    """At a turnover energy, weights and counts are reset; the robot's own count of steps is not."""
    learning = msgspec.structs.replace(DEFAULT.learning, initial_value=0.6)
    batch, _, (robot,) = new_robots(1, Settings(learning=learning))
    robot.start()
    rng = np.random.default_rng(2)
    for _ in range(3):
        step_until_slice_over(robot, rng)
        robot.hand_over()
    births = robot.turn_over()
    assert robot.generation == 1
    assert [birth.generation for birth in births] == [1] * LIFE.agents
    assert all(birth.step == robot.steps == 3 * LIFE.slice_steps for birth in births)
    assert (batch.energies[0] == LIFE.initial_energy).all()
    weights = weights_by_tile(batch, 0, 0.6 / learning.tilings)
    assert (weights == np.float32(0.6 / learning.tilings)).all()
    counted = ("module_steps", "captures", "matings", "mating_energy_sum", "steps_alive")
    for name in (*counted, "energy_sum"):
        assert not getattr(batch, name)[0].any()
    assert robot.subpopulation.turns.sum() == 1


def test_conception_follows_the_own_energy_and_nothing_else() -> None:
    """At energy 0.7 seven of ten matings conceive; below the threshold none does."""
    life = msgspec.structs.replace(LIFE, conception_threshold=0.2)
    batch, _, (robot,) = new_robots(1, Settings(life=life))
    robot.start()
    partner = MatingOffer("9/1", batch.genotypes[0, 1])
    batch.energies[0, robot.agent] = 0.7
    conceived = [robot.mate(partner) is not None for _ in range(2000)]
    assert abs(np.mean(conceived) - 0.7) < 0.04
    batch.energies[0, robot.agent] = 0.19
    assert not any(robot.mate(partner) for _ in range(200))


def test_an_offspring_is_of_the_agent_in_control_and_the_partner() -> None:
    """It is in the pool of one robot; what a robot gives to the other is an id and a genotype, no
    more."""
    batch, _, (one, two) = new_robots(2)
    one.start()
    two.start()
    batch.energies[:] = 1.0
    given = two.mating_offer()
    assert list(MatingOffer.__dataclass_fields__) == ["agent", "genes"]
    assert np.array_equal(given.genes, batch.genotypes[1, two.agent])
    child = one.mate(given)
    assert child is not None
    assert one.subpopulation.pool == [child]
    assert two.subpopulation.pool == []
    assert child.mother == one.subpopulation.ids[one.agent]
    assert child.father == two.subpopulation.ids[two.agent]


def test_a_robot_restored_in_the_middle_of_a_slice_has_the_same_future() -> None:
    """In another row of another batch, bit for bit, over hand-overs and a turnover."""
    _, _, (robot,) = new_robots(1, seed=3)
    robot.start()
    rng = np.random.default_rng(4)
    for _ in range(37):
        robot.step(random_observation(rng))
    _, _, others = new_robots(3, seed=9)
    for other in others:
        other.start()
    restored = others[1]
    restored.restore(robot.save())
    for _ in range(2 * LIFE.agents * LIFE.slices):
        seed = int(rng.integers(2**32))
        rngs = [np.random.default_rng(seed) for _ in range(2)]
        for _ in range(LIFE.slice_steps):
            first = robot.step(random_observation(rngs[0]))
            second = restored.step(random_observation(rngs[1]))
            assert np.array_equal(first, second)
            assert robot.events == restored.events
            if robot.events & SLICE_OVER:
                break
        assert robot.hand_over() == restored.hand_over()
        if robot.subpopulation.turns.min() == LIFE.slices:
            assert [b.genotype for b in robot.turn_over()] == [
                b.genotype for b in restored.turn_over()
            ]
    assert robot.generation == restored.generation
    assert np.array_equal(robot.save()["arrays"]["weights"], restored.save()["arrays"]["weights"])


def test_a_snapshot_does_not_change_with_the_robot() -> None:
    """It is a copy of everything."""
    _, _, (robot,) = new_robots(1)
    robot.start()
    saved = robot.save()
    kept = {name: value.copy() for name, value in saved["arrays"].items()}
    step_until_slice_over(robot, np.random.default_rng(5))
    robot.turn_over()
    for name, value in kept.items():
        assert np.array_equal(saved["arrays"][name], value), name


def test_a_snapshot_of_an_earlier_version_is_restored() -> None:
    """One whose fields have their former names gives the same robot."""
    _, _, (robot,) = new_robots(1)
    robot.start()
    step_until_slice_over(robot, np.random.default_rng(6))
    robot.hand_over()
    for _ in range(5):
        robot.step(random_observation(np.random.default_rng(7)))
    saved = robot.save()
    former = {name: former for former, name in FORMER_NAMES.items()}
    arrays = {former.get(name, name): value for name, value in saved["arrays"].items()}
    assert {"lived", "felt", "left", "rest", "live", "tiles", "clock", "used"} <= set(arrays)
    _, _, (other,) = new_robots(1, seed=2)
    other.start()
    other.restore({**saved, "arrays": arrays})
    for name, value in other.save()["arrays"].items():
        assert np.array_equal(value, saved["arrays"][name]), name


def test_weights_that_an_earlier_version_saved_are_restored() -> None:
    """It saved 64-bit weights of all tiles: what was learnt, and what is being learnt, goes on."""
    batch, parameters, (robot,) = new_robots(1)
    robot.start()
    rng = np.random.default_rng(8)
    for _ in range(30):
        robot.step(random_observation(rng))
    saved = robot.save()
    arrays = dict(saved["arrays"])
    table = weights_by_tile(batch, 0, parameters.initial_weight)
    arrays["weights"] = table.astype(np.float64)
    arrays["traces"] = arrays["traces"][:, :3]
    del arrays["weight_rows"], arrays["rows_used"]
    other_batch, _, (other,) = new_robots(1, seed=2)
    other.start()
    other.restore({**saved, "arrays": arrays})
    assert np.array_equal(weights_by_tile(other_batch, 0, parameters.initial_weight), table)
    for seed in range(30):
        rows = [random_observation(np.random.default_rng(seed)) for _ in range(2)]
        assert np.array_equal(robot.step(rows[0]), other.step(rows[1]))


def test_a_snapshot_whose_rows_are_beyond_its_weights_is_refused() -> None:
    """Compiled code checks no index."""
    _, _, (robot,) = new_robots(1)
    robot.start()
    for k in range(5):
        robot.step(random_observation(np.random.default_rng(k)))
    saved = robot.save()
    saved["arrays"]["weight_rows"][0, 0, 0] = int(saved["arrays"]["rows_used"])
    with pytest.raises(ValueError, match="does not fit these settings: weights"):
        robot.restore(saved)


def test_a_field_that_an_earlier_version_did_not_save_begins_at_zero() -> None:
    """Whatever the robot that is overwritten has counted."""
    batch, _, (robot,) = new_robots(1)
    robot.start()
    saved = robot.save()
    for name in ADDED:
        del saved["arrays"][name]
        getattr(batch, name)[0] = 1
    robot.restore(saved)
    assert not any(getattr(batch, name).any() for name in ADDED)


@pytest.mark.parametrize("name", ["weights", "steps_alive"])
def test_a_snapshot_without_a_field_is_refused_by_name(name: str) -> None:
    """It would leave a part of another robot."""
    _, _, (robot,) = new_robots(1)
    robot.start()
    saved = robot.save()
    del saved["arrays"][name]
    with pytest.raises(ValueError, match=f"does not fit these settings: {name}"):
        robot.restore(saved)


def test_a_snapshot_of_other_settings_is_refused() -> None:
    """With other tiles or agents it does not fit."""
    _, _, (robot,) = new_robots(1)
    robot.start()
    other = Settings(learning=msgspec.structs.replace(DEFAULT.learning, tilings=4))
    _, _, (different,) = new_robots(1, other)
    with pytest.raises(ValueError, match="does not fit"):
        different.restore(robot.save())


def test_informed_time_sharing_prefers_matings_per_step_alive() -> None:
    """After one slice each, the agent that mated most often for its time is in control."""
    batch, _, (robot,) = new_robots(1)
    robot.start()
    robot._time_sharing = EpsilonGreedyOrder(5, 0.0)
    robot.subpopulation.turns[:] = 1
    batch.steps_alive[0] = [100, 100, 10]
    batch.matings[0] = [2, 3, 1]
    assert robot.hand_over()
    assert robot.agent == 2


def test_informed_time_sharing_passes_over_the_dead() -> None:
    """However often they mated: with control of the robot they could do nothing."""
    batch, _, (robot,) = new_robots(1)
    robot.start()
    robot._time_sharing = EpsilonGreedyOrder(5, 0.0)
    robot.subpopulation.turns[:] = 1
    batch.steps_alive[0] = [100, 100, 10]
    batch.matings[0] = [0, 0, 9]
    batch.energies[0] = [0.0, 0.2, 0.0]
    assert robot.hand_over()
    assert robot.agent == 1


def test_a_robot_reproduces_as_it_was_told_last() -> None:
    """Also in a way that no setting names."""
    _, _, (robot, partner) = new_robots(2)
    robot.start()
    partner.start()
    robot.set_reproduction(ImplicitSelection(lambda _: 0.0))
    partner.set_reproduction(ImplicitSelection(lambda _: 1.0))
    assert robot.mate(partner.mating_offer()) is None
    assert partner.mate(robot.mating_offer()) is not None
