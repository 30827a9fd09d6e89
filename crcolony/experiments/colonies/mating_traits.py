"""Mating by what agents show of their health, and by what others make of it: the questions of thesis 6.1.

In the colony an agent conceives by its own energy, and takes whoever comes. Here it also weighs the partner, by traits
that are handed down beside the genotype, half from either parent, and that nothing else depends on:

- *lie*: the part of its missing energy that an agent pretends to have. The lie is in what it shows, not in what it is;
- *doubt*: the part of a partner's lie that it sees through;
- *choosiness*: the energy that it wants a partner to have.

A trait to which a colony pays no attention is neutral, and shows how far chance alone leads.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from crcolony.compiled import FloatArray, IntArray
from crcolony.evolution.genotype import Gene, Schema, Uniform
from crcolony.evolution.population import NewAgent, Offspring, Subpopulation
from crcolony.evolution.reproduction import MatingAgent, MatingOffer
from crcolony.randomness import EventGenerator, Stream, draw_uncompiled

NAMES = ("lie", "doubt", "choosiness")
LIE, DOUBT, CHOOSINESS = range(len(NAMES))
_MUTATION_SD = 0.15
"""As of the meta-parameters"""
TRAITS = Schema(
    tuple(Gene(name, 0.0, 1.0, Uniform(0.0, 1.0), mutation_sd=_MUTATION_SD) for name in NAMES)
)


@dataclass(frozen=True, eq=False)
class HealthOffer(MatingOffer):
    """What an agent gives in a mating, with its traits, and what it is like."""

    traits: FloatArray
    """(traits,)"""
    health: float
    """Its energy, from 0 to 1, which the partner may not be told"""


@dataclass(frozen=True, eq=False)
class TraitOffspring(Offspring):
    """A genotype in the pool with the traits that go with it."""

    traits: FloatArray
    """(traits,)"""


Acceptance = Callable[[FloatArray, HealthOffer], float]
"""The probability that an agent with these traits accepts a partner, if its own energy suffices."""


def by_shown_health(own: FloatArray, partner: HealthOffer, *, lies: bool, doubts: bool) -> float:
    """Accept a partner with the probability that is the health that it seems to have."""
    lie = float(partner.traits[LIE]) if lies else 0.0
    doubt = float(own[DOUBT]) if doubts else 0.0
    return partner.health + (1.0 - doubt) * lie * (1.0 - partner.health)


def by_threshold(own: FloatArray, partner: HealthOffer, *, threshold: float | None) -> float:
    """Accept a partner that has so much energy; None: as much as the own choosiness asks for."""
    wanted = float(own[CHOOSINESS]) if threshold is None else threshold
    return 1.0 if partner.health >= wanted else 0.0


class TraitSelection:
    """Implicit selection (Paper III) in which the partner is weighed as well."""

    def __init__(
        self,
        conception_probability: Callable[[float], float],
        accept: Acceptance,
        traits: FloatArray,
    ) -> None:
        """The first generation has these `traits` (agents, traits)."""
        self.traits = traits
        self._conception_probability = conception_probability
        self._accept = accept
        self._events = EventGenerator()

    def offer(self, own: MatingAgent, stream: Stream) -> HealthOffer:
        """Return genotype, traits and health."""
        return HealthOffer(own.id, own.genes, self.traits[own.index].copy(), own.energy)

    def receive(self, own: MatingAgent, partner: MatingOffer, stream: Stream) -> Offspring | None:
        """Put an offspring with the partner into the pool, or not: by the own energy, and by the partner."""
        assert isinstance(partner, HealthOffer), "all robots of a colony reproduce in the same way"
        traits = self.traits[own.index]
        probability = self._conception_probability(own.energy) * self._accept(traits, partner)
        if draw_uncompiled(stream) >= probability:
            return None
        rng, subpopulation = self._events.begin(stream), own.subpopulation
        offspring_of = subpopulation.variation.offspring
        offspring = TraitOffspring(
            offspring_of(own.genes, partner.genes, subpopulation.schema, rng),
            own.id,
            partner.agent,
            own.step,
            offspring_of(traits, partner.traits, TRAITS, rng),
        )
        subpopulation.add_to_pool(offspring, rng)
        return offspring

    def next_agents(
        self, subpopulation: Subpopulation, matings: IntArray, rng: np.random.Generator
    ) -> list[NewAgent]:
        """Return agents that are drawn from the pool; from an empty one, mutated copies, with mutated traits."""
        pool = [one for one in subpopulation.pool if isinstance(one, TraitOffspring)]
        if not pool:
            mutant = subpopulation.variation.mutant
            self.traits = np.stack([mutant(traits, TRAITS, rng) for traits in self.traits])
            return subpopulation.draw_next_generation(rng)
        drawn = [pool[k] for k in rng.integers(len(pool), size=len(subpopulation.ids))]
        self.traits = np.stack([one.traits for one in drawn])
        return [NewAgent(one.genes, one.mother, one.father) for one in drawn]

    def save(self) -> dict[str, Any]:
        """Raise AssertionError: these colonies live in one go."""
        raise AssertionError("colonies with traits are not saved")

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Raise AssertionError, too."""
        raise AssertionError("colonies with traits are not restored")
