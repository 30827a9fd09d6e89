"""PGTA, the probabilistic gene transfer algorithm (Watson, Ficici and Pollack 2002, Robot. Auton. Syst. 39:1-18).

An agent broadcasts one of its genes, mutated, the more often the more energy it has; one that receives it overwrites
its own gene the more readily the less energy it has. No parents, no offspring, no generations: genes change in a
living agent.

The loop is known at second hand (thesis 4.5, and an annotated bibliography). In it a step is either for sending or for
receiving; an encounter is longer than a step, so that an agent may do both. Sending costs no energy here. A gene that
is not sent is NaN.
"""

import numpy as np

from crcolony.compiled import FloatArray, IntArray
from crcolony.evolution.population import NewAgent, Offspring, Subpopulation
from crcolony.evolution.reproduction import MatingAgent, MatingOffer, WithoutMemory
from crcolony.evolution.variation import gaussian_mutation
from crcolony.randomness import EventGenerator, Stream, draw_uncompiled


def send_probability(energy: float) -> float:
    """Return how likely an agent with this energy, 0 to 1, broadcasts a gene."""
    return min(max(energy, 0.0), 1.0)


def accept_probability(energy: float) -> float:
    """Return how likely an agent with this energy, 0 to 1, overwrites a gene with one that it receives."""
    return 1.0 - send_probability(energy)


def one_gene(genes: FloatArray, locus: int) -> FloatArray:
    """Return a broadcast of one gene (genes,): all others are NaN."""
    sent = np.full_like(genes, np.nan)
    sent[locus] = genes[locus]
    return sent


def overwrite(genes: FloatArray, sent: FloatArray) -> bool:
    """Write the gene of a broadcast, (genes,) both, over the own one; return whether there was one in it."""
    is_sent = ~np.isnan(sent)
    genes[is_sent] = sent[is_sent]
    return bool(is_sent.any())


class Pgta(WithoutMemory):
    """Transfers single genes between living agents; the one that is sent mutates with a probability.

    When a generation is over the agents keep their genes: it only begins what they have learnt, and their energy, anew.
    An agent that has starved comes back so, which has no counterpart in the original, where nobody dies. The pool holds
    what has been accepted, so that births name the donor that was last.
    """

    def __init__(self, mutation_probability: float) -> None:
        self._mutation_probability = mutation_probability
        self._events = EventGenerator()

    def offer(self, own: MatingAgent, stream: Stream) -> MatingOffer:
        """Return one random gene, mutated, or none."""
        if draw_uncompiled(stream) >= send_probability(own.energy):
            return MatingOffer(own.id, np.full_like(own.genes, np.nan))
        rng = self._events.begin(stream)
        schema = own.subpopulation.schema
        mutated = gaussian_mutation(own.genes, schema, self._mutation_probability, rng)
        return MatingOffer(own.id, one_gene(mutated, int(rng.integers(len(schema)))))

    def receive(self, own: MatingAgent, partner: MatingOffer, stream: Stream) -> Offspring | None:
        """Overwrite the own gene, or not, by the own energy; return the genotype if it was overwritten."""
        if draw_uncompiled(stream) >= accept_probability(own.energy):
            return None
        if not overwrite(own.genes, partner.genes):
            return None
        changed = Offspring(own.genes.copy(), own.id, partner.agent, own.step)
        own.subpopulation.add_to_pool(changed, self._events.begin(stream))
        return changed

    def next_agents(
        self, subpopulation: Subpopulation, matings: IntArray, rng: np.random.Generator
    ) -> list[NewAgent]:
        """Return the same agents, as they are now."""
        donors = {one.mother: one.father for one in subpopulation.pool}
        return [
            NewAgent(genes.copy(), own, donors.get(own))
            for genes, own in zip(subpopulation.genotypes, subpopulation.ids, strict=True)
        ]
