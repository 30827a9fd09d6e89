"""PEGA, the physically embedded genetic algorithm (Nehmzow 2002, EpiRob 2; thesis 4.5).

A robot has two strings, the present one and the best so far. After an evaluation robots exchange strings and their
fitness, and apply genetic operators according to it; where that brings no improvement, the best string is used again.

Its abstract and the thesis say no more. Here each virtual agent is such a robot. Its fitness is the number of its
matings, of which its present one tells the partner; the last partner of a lifetime counts, which is when both are
nearly evaluated. A string that is better than the best so far, or is the best one itself, is crossed with the
partner's if that was fitter when they met, and else mutated; any other gives way to the best one, which is then
evaluated again: a fitness that was luck does not last.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from crcolony.compiled import FloatArray, IntArray
from crcolony.evolution.lineage import AgentId
from crcolony.evolution.population import NewAgent, Offspring, Subpopulation
from crcolony.evolution.reproduction import MatingAgent, MatingOffer
from crcolony.randomness import EventGenerator, Stream


@dataclass(frozen=True)
class RatedOffer(MatingOffer):
    """A genotype and its fitness: what the colony's own strategy never sends."""

    fitness: float


@dataclass(frozen=True, eq=False)
class BestString:
    """The fittest genotype that an agent's place has had."""

    genes: FloatArray
    agent: AgentId
    fitness: float


class Pega:
    """Keeps the best string of every agent; the pool holds, for each, that of a fitter partner, if the last one was."""

    def __init__(self) -> None:
        self._best: list[BestString] = []
        self._events = EventGenerator()

    def offer(self, own: MatingAgent, stream: Stream) -> RatedOffer:
        """Return the present string and its fitness so far."""
        return RatedOffer(own.id, own.genes, float(own.matings))

    def receive(self, own: MatingAgent, partner: MatingOffer, stream: Stream) -> Offspring | None:
        """Keep the partner's string, in place of any earlier one, if it is fitter; else keep none."""
        assert isinstance(partner, RatedOffer), "a partner of this strategy says how fit it is"
        pool = own.subpopulation.pool
        pool[:] = [kept for kept in pool if kept.mother != own.id]
        if partner.fitness <= own.matings:
            return None
        kept = Offspring(partner.genes.copy(), own.id, partner.agent, own.step)
        own.subpopulation.add_to_pool(kept, self._events.begin(stream))
        return kept

    def next_agents(
        self, subpopulation: Subpopulation, matings: IntArray, rng: np.random.Generator
    ) -> list[NewAgent]:
        """Return what the operators make of each agent's string, or its best one where that was no improvement."""
        present = [
            BestString(genes.copy(), agent, float(fitness))
            for genes, agent, fitness in zip(
                subpopulation.genotypes, subpopulation.ids, matings, strict=True
            )
        ]
        kept = {one.mother: one for one in subpopulation.pool}
        before = self._best or present
        self._best = [
            now if now.fitness > best.fitness or np.array_equal(now.genes, best.genes) else best
            for now, best in zip(present, before, strict=True)
        ]
        return [
            _offspring(now, kept.get(now.agent), subpopulation, rng)
            if best is now
            else NewAgent(best.genes, best.agent, None)
            for now, best in zip(present, self._best, strict=True)
        ]

    def save(self) -> dict[str, Any]:
        """Return the best strings."""
        return {"best": [(one.genes.copy(), one.agent, one.fitness) for one in self._best]}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Remember the best strings."""
        self._best = [BestString(np.array(genes), *rest) for genes, *rest in saved["best"]]


def _offspring(
    own: BestString,
    partner: Offspring | None,
    subpopulation: Subpopulation,
    rng: np.random.Generator,
) -> NewAgent:
    variation, schema = subpopulation.variation, subpopulation.schema
    if partner is None:
        return NewAgent(variation.mutant(own.genes, schema, rng), own.agent, None)
    genes = variation.offspring(own.genes, partner.genes, schema, rng)
    return NewAgent(genes, own.agent, partner.father)
