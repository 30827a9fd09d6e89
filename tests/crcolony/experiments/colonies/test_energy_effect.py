"""The effect of energy on the choice to mate is that of selectors whose choices are known."""

import math

import numpy as np
import pytest

from crcolony.experiments.colonies.energy_effect import choices_of, measure_energy_effect
from crcolony.in_process.colony import InProcessColony
from crcolony.robot.step import select_module
from tests.support.small_colony import new_colony


def colony_with(bias: float, energy: float, face: float = 0.0) -> InProcessColony:
    """Return a colony that has begun, whose agents all have the same selector, which ignores packs."""
    colony, _ = new_colony("life.initial_energy=0.6")
    colony.start()
    weights = {"bias": bias, "energy": energy, "mating_target_visible": face}
    for name in ("bias", "energy", "foraging_target_visible", "mating_target_visible"):
        gene = colony.schema.index(f"selector.mating.{name}")
        colony.batch.genotypes[:, :, gene] = weights.get(name, 0.0)
    return colony


@pytest.mark.parametrize(
    ("bias", "energy", "effect"), [(-0.5, 1.0, 1.0), (0.5, -1.0, -1.0), (1.0, 0.1, 0.0)]
)
def test_a_selector_with_a_threshold_has_the_whole_effect(
    bias: float, energy: float, effect: float
) -> None:
    """Mate above half the energy, below it, or always."""
    found = measure_energy_effect(colony_with(bias, energy))
    assert found.effect == effect
    assert math.isnan(found.correlation) == (effect == 0.0)
    assert found.correlation * effect >= 0.0 or effect == 0.0


def test_the_effect_is_taken_at_what_agents_see() -> None:
    """Where energy matters only while a face is visible, it is the share of steps with a face, agent by agent."""
    mate_by_face = (-1.0, 1.0, 0.7)
    faces: dict[tuple[int, int], list[float]] = {}
    for choice in choices_of(colony_with(*mate_by_face)):
        faces.setdefault((choice.robot, choice.agent), []).append(float(choice.visible[1]))
    shares = [np.mean(own) for own in faces.values()]
    assert 0.0 < np.mean(shares) < 1.0
    assert len(shares) == 16
    found = measure_energy_effect(colony_with(*mate_by_face))
    assert found.effect == pytest.approx(np.mean(shares), rel=1e-12)
    assert (found.effect_facing, found.effect_searching) == (1.0, 0.0)


def test_choices_are_those_that_the_robots_make() -> None:
    """Agent, energy and what is visible lead to the module that the robot has selected at that very tick."""
    colony, twin = colony_with(-1.0, 1.0, 0.7), colony_with(-1.0, 1.0, 0.7)
    compared = 0
    for choice in choices_of(colony):
        while twin.tick < colony.tick:
            twin.run(1)
        assert choice.energy == twin.batch.energies[choice.robot, choice.agent]
        module = twin.batch.module[choice.robot]
        if module >= 0:  # a slice that has just ended has released its module
            genes = colony.batch.genotypes[choice.robot, choice.agent]
            assert module == select_module(genes, choice.energy, choice.visible, 2)
            compared += 1
    assert compared > 100
    assert colony.generation == 1


def test_a_correlation_is_not_the_effect() -> None:
    """Agents that differ: who always mates has little energy, who never does has more; energy changes nothing."""
    colony = colony_with(0.0, 0.0)
    bias = colony.schema.index("selector.mating.bias")
    colony.batch.genotypes[:, :2, bias] = 1.0
    colony.batch.energies[:, :2] = 0.2
    colony.batch.energies[:, 2:] = 1.0
    found = measure_energy_effect(colony)
    assert found.effect == 0.0
    assert found.correlation < -0.3
