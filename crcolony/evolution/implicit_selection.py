"""Paper III (thesis 5.3): implicit selection by mating; an agent conceives with a probability that its energy gives.

This is the colony's own strategy. Conceived offspring wait in the robot's pool, from which its next agents are drawn.
"""

from collections.abc import Callable

import numpy as np

from crcolony.compiled import IntArray
from crcolony.evolution.population import NewAgent, Offspring, Subpopulation
from crcolony.evolution.reproduction import MatingAgent, MatingOffer, WithoutMemory
from crcolony.randomness import EventGenerator, Stream, draw_uncompiled


class ImplicitSelection(WithoutMemory):
    """Conceives with the probability that `conception_probability` returns for an energy."""

    def __init__(self, conception_probability: Callable[[float], float]) -> None:
        self._conception_probability = conception_probability
        self._events = EventGenerator()

    def receive(self, own: MatingAgent, partner: MatingOffer, stream: Stream) -> Offspring | None:
        """Put an offspring with the partner into the pool, or not, by the own energy."""
        if draw_uncompiled(stream) >= self._conception_probability(own.energy):
            return None
        rng = self._events.begin(stream)
        return own.subpopulation.conceive(own.index, partner.genes, partner.agent, own.step, rng)

    def next_agents(
        self, subpopulation: Subpopulation, matings: IntArray, rng: np.random.Generator
    ) -> list[NewAgent]:
        """Return agents that are drawn from the pool."""
        return subpopulation.draw_next_generation(rng)
