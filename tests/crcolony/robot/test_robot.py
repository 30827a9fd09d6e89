"""What is rare in a robot's life: hand-over, mating, turnover, and being saved and restored whole."""

import msgspec
import numpy as np
import pytest

from crcolony.evolution.time_sharing import EpsilonGreedyOrder
from crcolony.robot.robot import Exchange, Robot
from crcolony.robot.state import SLICE_OVER
from tests.support.small_robots import DEFAULT, Settings, new_robots, observation

LIFE = DEFAULT.life


def live_slice(robot: Robot, rng: np.random.Generator) -> None:
    while True:
        robot.step(observation(rng))
        if robot.events & SLICE_OVER:
            return


def test_every_agent_has_its_slices_and_then_the_generation_is_over() -> None:
    """Hand-overs give each agent as many slices as configured, and then refuse."""
    _, _, (robot,) = new_robots(1)
    births = robot.start()
    assert len(births) == LIFE.agents
    rng = np.random.default_rng(1)
    turns = [robot.agent]
    while True:
        live_slice(robot, rng)
        if not robot.hand_over():
            break
        turns.append(robot.agent)
    assert sorted(turns) == sorted(list(range(LIFE.agents)) * LIFE.slices)
    assert robot.steps == len(turns) * LIFE.slice_steps


def test_a_turnover_gives_birth_to_newborns_that_know_nothing() -> None:
    """Energy, weights and counts are those of the first day; the robot's own clock goes on."""
    learning = msgspec.structs.replace(DEFAULT.learning, initial_value=0.6)
    batch, _, (robot,) = new_robots(1, Settings(learning=learning))
    robot.start()
    rng = np.random.default_rng(2)
    for _ in range(3):
        live_slice(robot, rng)
        robot.hand_over()
    births = robot.turn_over()
    assert robot.generation == 1
    assert [birth.generation for birth in births] == [1] * LIFE.agents
    assert all(birth.step == robot.steps == 3 * LIFE.slice_steps for birth in births)
    assert (batch.energies[0] == LIFE.initial_energy).all()
    assert (batch.weights[0] == 0.6 / learning.tilings).all()
    for name in ("used", "captures", "matings", "steps_alive", "energy_sum"):
        assert not getattr(batch, name)[0].any()
    assert robot.subpopulation.turns.sum() == 1


def test_conception_follows_the_own_energy_and_nothing_else() -> None:
    """At energy 0.7 seven of ten matings conceive; below the threshold none does."""
    life = msgspec.structs.replace(LIFE, conception_threshold=0.2)
    batch, _, (robot,) = new_robots(1, Settings(life=life))
    robot.start()
    partner = Exchange("9/1", batch.genotypes[0, 1])
    batch.energies[0, robot.agent] = 0.7
    conceived = [robot.mate(partner) is not None for _ in range(2000)]
    assert abs(np.mean(conceived) - 0.7) < 0.04
    batch.energies[0, robot.agent] = 0.19
    assert not any(robot.mate(partner) for _ in range(200))


def test_an_offspring_is_of_the_agent_in_control_and_the_partner() -> None:
    """It waits in the own pool; what is exchanged is a name and a genotype, no more."""
    batch, _, (one, two) = new_robots(2)
    one.start()
    two.start()
    batch.energies[:] = 1.0
    given = two.exchange()
    assert list(Exchange.__dataclass_fields__) == ["agent", "genes"]
    assert np.array_equal(given.genes, batch.genotypes[1, two.agent])
    child = one.mate(given)
    assert child is not None
    assert one.subpopulation.pool == [child]
    assert two.subpopulation.pool == []
    assert child.mother == one.subpopulation.ids[one.agent]
    assert child.father == two.subpopulation.ids[two.agent]


def test_saving_and_restoring_in_the_middle_of_a_slice_changes_nothing() -> None:
    """A robot restored into another row of another batch lives on, bit for bit, over hand-overs and a turnover."""
    _, _, (robot,) = new_robots(1, seed=3)
    robot.start()
    rng = np.random.default_rng(4)
    for _ in range(37):
        robot.step(observation(rng))
    batch, _, others = new_robots(3, seed=9)
    for other in others:
        other.start()
    twin = others[1]
    twin.restore(robot.save())
    for _ in range(2 * LIFE.agents * LIFE.slices):
        seed = int(rng.integers(2**32))
        live = [np.random.default_rng(seed) for _ in range(2)]
        for _ in range(LIFE.slice_steps):
            first = robot.step(observation(live[0]))
            second = twin.step(observation(live[1]))
            assert np.array_equal(first, second)
            assert robot.events == twin.events
            if robot.events & SLICE_OVER:
                break
        assert robot.hand_over() == twin.hand_over()
        if robot.subpopulation.turns.min() == LIFE.slices:
            assert [b.genotype for b in robot.turn_over()] == [b.genotype for b in twin.turn_over()]
    assert robot.generation == twin.generation
    assert np.array_equal(robot.save()["arrays"]["weights"], batch.weights[1])


def test_what_was_saved_does_not_change_with_the_robot() -> None:
    """A snapshot is a copy of everything."""
    _, _, (robot,) = new_robots(1)
    robot.start()
    saved = robot.save()
    kept = {name: value.copy() for name, value in saved["arrays"].items()}
    live_slice(robot, np.random.default_rng(5))
    robot.turn_over()
    for name, value in kept.items():
        assert np.array_equal(saved["arrays"][name], value), name


def test_a_snapshot_of_another_kind_of_robot_is_refused() -> None:
    """With other tiles or agents it does not fit."""
    _, _, (robot,) = new_robots(1)
    robot.start()
    other = Settings(learning=msgspec.structs.replace(DEFAULT.learning, tilings=4))
    _, _, (stranger,) = new_robots(1, other)
    with pytest.raises(ValueError, match="does not fit"):
        stranger.restore(robot.save())


def test_informed_time_sharing_looks_at_matings_for_the_time_lived() -> None:
    """After everybody's first slice the agent that mated most by time is in control."""
    batch, _, (robot,) = new_robots(1)
    robot.start()
    robot._time_sharing = EpsilonGreedyOrder(5, 0.0)
    robot.subpopulation.turns[:] = 1
    batch.steps_alive[0] = [100, 100, 10]
    batch.matings[0] = [2, 3, 1]
    assert robot.hand_over()
    assert robot.agent == 2
