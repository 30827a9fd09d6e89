"""A colony whose agents weigh their partners by traits, from founders that forage and mate already."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.config import Config
from crcolony.evolution.founders import Founders
from crcolony.evolution.history import Event, Mated
from crcolony.experiments.colonies.mating_traits import TRAITS, Acceptance, TraitSelection
from crcolony.in_process.colony import InProcessColony
from crcolony.randomness import generator, new_streams
from crcolony.robot.energy import conception_probability

_CHUNK_TICKS = 10_000
_FIRST_TRAITS = 8
"""The name of the streams by which the traits of founders are drawn"""


@dataclass(frozen=True)
class TraitRun:
    """What came of a colony."""

    rows: list[dict[str, float]]
    """One a generation, as in `generations.csv`"""
    traits: FloatArray
    """(generations, traits) mean over the newborn agents of each generation"""
    matings: list[Mated]

    @property
    def accepted(self) -> float:
        """The share of the times that an agent met another in which it conceived."""
        return float(np.mean([conceived for _, conceived in self._partners()]))

    @property
    def selection(self) -> float:
        """How much more energy the partners have with which agents conceive, than all that they meet."""
        partners = self._partners()
        taken = [energy for energy, conceived in partners if conceived]
        return float(np.mean(taken) - np.mean([energy for energy, _ in partners]))

    def _partners(self) -> list[tuple[float, bool]]:
        """Return the energy of every partner, and whether the agent that met it conceived."""
        return [
            pair
            for one in self.matings
            for pair in ((one.partner_energy, one.conceived), (one.energy, one.partner_conceived))
        ]


def run_with_traits(config: Config, founders: Founders, accept: Acceptance) -> TraitRun:
    """Let founders with random traits live in a config for its generations, and accept partners in this way.

    Colonies of the same seed begin with the same traits.
    """
    matings: list[Mated] = []

    def record(event: Event) -> None:
        if isinstance(event, Mated):
            matings.append(event)

    colony = InProcessColony(config, record, founders)
    strategies = [_strategy(config, row, accept) for row in range(config.robots)]
    for robot, strategy in zip(colony.robots, strategies, strict=True):
        robot.set_reproduction(strategy)
    colony.start()
    rows: list[dict[str, float]] = []
    traits = [_mean_traits(strategies)]
    while colony.generation < config.generations:
        colony.run(_CHUNK_TICKS)
        if colony.generation > len(rows):
            rows.append(colony.summary)
            traits.append(_mean_traits(strategies))
    return TraitRun(rows, np.stack(traits[:-1]), matings)


def _strategy(config: Config, row: int, accept: Acceptance) -> TraitSelection:
    rng = generator(new_streams(config.seed, (_FIRST_TRAITS, row), 1)[0])
    life = config.life
    conceives = partial(
        conception_probability,
        threshold=life.conception_threshold,
        exponent=life.conception_exponent,
    )
    traits = np.stack([TRAITS.random(rng) for _ in range(life.agents)])
    return TraitSelection(conceives, accept, traits)


def _mean_traits(strategies: Sequence[TraitSelection]) -> FloatArray:
    mean: FloatArray = np.concatenate([one.traits for one in strategies]).mean(axis=0)
    return mean
