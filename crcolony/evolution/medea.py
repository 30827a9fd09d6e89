"""mEDEA (Bredeche and Montanier, PPSN 2010, pp. 290-299; MCMDS 18(1), 2012): the next genome is a random received one.

In a lifetime a robot keeps the genome of everyone it has met, once. Then one of them, drawn uniformly, is mutated and
lives on; the reserve is cleared. There is no fitness and no energy in it: who meets more robots spreads further.

A robot with virtual agents keeps one reserve, from which each of its next agents is drawn. The original robot whose
reserve is empty stands still until it receives a genome; here robots meet only when both drive up to each other, so
that one which stood still would never come back: its agents live on, mutated. The step size sigma is fixed, as by
default in roborobo4: one that evolves would have to be sent.
"""

import math

import numpy as np

from crcolony.compiled import FloatArray, IntArray
from crcolony.evolution.genotype import Schema
from crcolony.evolution.population import NewAgent, Offspring, Subpopulation
from crcolony.evolution.reproduction import MatingAgent, MatingOffer, WithoutMemory
from crcolony.randomness import EventGenerator, Stream


class Medea(WithoutMemory):
    """Mutates every gene by `sigma` times its own deviation."""

    def __init__(self, sigma: float) -> None:
        self._sigma = sigma
        self._events = EventGenerator()

    def receive(self, own: MatingAgent, partner: MatingOffer, stream: Stream) -> Offspring | None:
        """Keep the partner's genome, unless it is in the reserve already."""
        subpopulation = own.subpopulation
        if any(kept.father == partner.agent for kept in subpopulation.pool):
            return None
        kept = Offspring(partner.genes.copy(), own.id, partner.agent, own.step)
        subpopulation.add_to_pool(kept, self._events.begin(stream))
        return kept

    def next_agents(
        self, subpopulation: Subpopulation, matings: IntArray, rng: np.random.Generator
    ) -> list[NewAgent]:
        """Return mutated copies of genomes drawn from the reserve; from an empty one, of the present agents."""
        schema, pool = subpopulation.schema, subpopulation.pool
        if pool:
            drawn = [pool[k] for k in rng.integers(len(pool), size=len(subpopulation.ids))]
            parents = [(one.genes, one.father) for one in drawn]
        else:
            parents = list(zip(subpopulation.genotypes, subpopulation.ids, strict=True))
        return [
            NewAgent(bounced(genes + self._step(schema, rng), schema), parent, None)
            for genes, parent in parents
        ]

    def _step(self, schema: Schema, rng: np.random.Generator) -> FloatArray:
        step: FloatArray = self._sigma * schema.mutation_sds * rng.standard_normal(len(schema))
        return step


def equal_variance_sigma(mutation_probability: float) -> float:
    """Return the sigma with which a gene moves as far as one that mutates with this probability: of equal variance."""
    return math.sqrt(mutation_probability)


def bounced(genes: FloatArray, schema: Schema) -> FloatArray:
    """Return genes (genes,) reflected at the ends of their ranges; one that is still outside stops at an end."""
    lows, highs = schema.lows, schema.highs
    inside = np.where(genes < lows, 2.0 * lows - genes, genes)
    inside = np.where(inside > highs, 2.0 * highs - inside, inside)
    reflected: FloatArray = np.minimum(np.maximum(inside, lows), highs)
    return reflected
