"""The causal effect of energy on the choice to mate: what an evolved agent would choose with another energy.

Over the steps of a colony, energy and choice are correlated for other reasons, too: agents that forage well have more
energy, and those that mate find less. So the energy input of the selector is set to a low and to a high value at steps
that the agents really lived, with their own genotypes and with what they saw there; everything else stays equal.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.in_process.colony import InProcessColony
from crcolony.robot.modules import MATING, MODULES
from crcolony.robot.step import select_module

LOW_ENERGY, HIGH_ENERGY = 0.2, 0.9
"""The two values of the energy input."""
_MATE = MODULES.index(MATING)
"""Where `Choice.visible` says whether a face is visible."""
_TICKS_APART = 5
"""Successive steps are much alike: only every fifth is used."""


class Choice(NamedTuple):
    """A step at which an agent, alive and in control of a robot, selected a module."""

    robot: int
    agent: int
    energy: float
    visible: FloatArray
    """(modules,) 1 where the target of a module is visible"""


@dataclass(frozen=True)
class EnergyEffect:
    """How the choice to mate depends on energy in a colony."""

    effect: float
    """By how much the probability of selecting the mating module rises from low to high energy; mean over agents"""
    effect_facing: float
    """The same at the steps at which a face is visible; NaN if there are none"""
    effect_searching: float
    """The same at the steps at which no face is visible; NaN if there are none"""
    correlation: float
    """Of energy and choice over steps (Pearson), confounded; NaN if all choices are the same"""


def measure_energy_effect(colony: InProcessColony) -> EnergyEffect:
    """Let a colony live until its generation ends, and return how energy affects the choices of its agents."""
    energies, choices = [], []
    lives: dict[tuple[int, int], list[tuple[float, bool]]] = {}
    for choice in choices_of(colony):
        genes = colony.batch.genotypes[choice.robot, choice.agent]
        low, real, high = (
            _selects_mating(genes, energy, choice.visible)
            for energy in (LOW_ENERGY, choice.energy, HIGH_ENERGY)
        )
        is_facing = bool(choice.visible[_MATE] > 0.0)
        lives.setdefault((choice.robot, choice.agent), []).append((high - low, is_facing))
        energies.append(choice.energy)
        choices.append(real)
    if not choices:
        return EnergyEffect(0.0, math.nan, math.nan, math.nan)
    steps = [np.array(own).T for own in lives.values()]
    return EnergyEffect(
        _mean_over([rises for rises, _ in steps]),
        _mean_over([rises[facing == 1.0] for rises, facing in steps]),
        _mean_over([rises[facing == 0.0] for rises, facing in steps]),
        _correlation(np.array(energies), np.array(choices)),
    )


def choices_of(colony: InProcessColony) -> Iterator[Choice]:
    """Let a colony live until its generation ends; yield a part of its agents' choices.

    The agents' genotypes are those of the colony until the last choice has been taken.
    """
    generation = colony.generation
    robots = range(len(colony.robots))
    while True:
        colony.run(_TICKS_APART - 1)
        agents = colony.batch.agent.copy()  # a slice that ends hands over to the next one
        if colony.generation == generation:
            colony.run(1)
        if colony.generation > generation:
            return
        for robot, agent in zip(robots, agents.tolist(), strict=True):
            energy = float(colony.batch.energies[robot, agent])
            if energy > 0.0:
                yield Choice(robot, agent, energy, colony.batch.visible[robot].copy())


def _selects_mating(genes: FloatArray, energy: float, visible: FloatArray) -> float:
    return float(MODULES[select_module(genes, energy, visible, len(MODULES))] is MATING)


def _mean_over(lives: Sequence[FloatArray]) -> float:
    """Return the mean over agents of their means; of those that have any steps of a kind."""
    means = [own.mean() for own in lives if own.size]
    return float(np.mean(means)) if means else math.nan


def _correlation(energies: FloatArray, choices: FloatArray) -> float:
    if np.ptp(energies) == 0.0 or np.ptp(choices) == 0.0:
        return math.nan
    return float(np.corrcoef(energies, choices)[0, 1])
