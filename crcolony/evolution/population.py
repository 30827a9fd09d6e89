"""A subpopulation of virtual agents in one robot: offspring pool and turnover (thesis 4.5, 5.3)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.evolution.genotype import Schema, genotype_digest
from crcolony.evolution.lineage import AgentId, Birth, agent_id
from crcolony.evolution.variation import Variation


@dataclass(frozen=True, eq=False)
class Offspring:
    """A genotype in the pool of offspring for the next generation."""

    genes: FloatArray
    mother: AgentId
    father: AgentId
    step: int


@dataclass(frozen=True, eq=False)
class NewAgent:
    """The genes and the parents of an agent of the next generation."""

    genes: FloatArray
    mother: AgentId | None
    father: AgentId | None


class Subpopulation:
    """The agents of one robot, and the pool of offspring that they have conceived.

    `genotypes` (agents, genes) is written in place: it may be a row of a batch. The pool keeps at
    most `pool_limit` offspring; one beyond that may replace a random one, so that all have the same
    chance to be kept (a reservoir). `founders`, one for each agent, are its first generation; without
    them that is random.
    """

    def __init__(
        self,
        robot: str,
        schema: Schema,
        variation: Variation,
        genotypes: FloatArray,
        pool_limit: int,
        founders: Sequence[NewAgent] = (),
    ) -> None:
        self.robot = robot
        self.schema = schema
        self.variation = variation
        self.genotypes = genotypes
        self.ids: list[AgentId] = [""] * genotypes.shape[0]
        self.turns = np.zeros(genotypes.shape[0], dtype=np.int64)
        self.pool: list[Offspring] = []
        self.conceived = 0
        self.born = 0
        self._pool_limit = pool_limit
        self._founders = tuple(founders)

    def draw_first_generation(self, rng: np.random.Generator) -> list[NewAgent]:
        """Return the founders, or if there are none, as many random agents, without parents, as
        the subpopulation has."""
        if self._founders:
            return list(self._founders)
        return [NewAgent(self.schema.random(rng), None, None) for _ in self.ids]

    def conceive(
        self,
        agent: int,
        partner_genes: FloatArray,
        partner: AgentId,
        step: int,
        rng: np.random.Generator,
    ) -> Offspring:
        """Make an offspring of an own agent and a partner's genotype, put it into the pool and
        return it."""
        own = self.genotypes[agent]
        genes = self.variation.offspring(own, partner_genes, self.schema, rng)
        offspring = Offspring(genes, self.ids[agent], partner, step)
        self.add_to_pool(offspring, rng)
        return offspring

    def add_to_pool(self, offspring: Offspring, rng: np.random.Generator) -> None:
        """Put an offspring into the pool; in a full one it replaces a random one, or is dropped
        itself."""
        self.conceived += 1
        if len(self.pool) < self._pool_limit:
            self.pool.append(offspring)
        else:
            index = int(rng.integers(self.conceived))
            if index < self._pool_limit:
                self.pool[index] = offspring

    def draw_next_generation(self, rng: np.random.Generator) -> list[NewAgent]:
        """Return as many agents, drawn from the pool with replacement, as the subpopulation has.

        With an empty pool they are mutated copies of the present agents.
        """
        if self.pool:
            drawn = [self.pool[k] for k in rng.integers(len(self.pool), size=len(self.ids))]
            return [NewAgent(one.genes, one.mother, one.father) for one in drawn]
        return [
            NewAgent(self.variation.mutant(genes, self.schema, rng), mother, None)
            for genes, mother in zip(self.genotypes, self.ids, strict=True)
        ]

    def replace_agents(self, agents: Sequence[NewAgent], generation: int, step: int) -> list[Birth]:
        """Replace all agents by new ones, give them ids, and empty the pool; return their
        births."""
        births = []
        for index, agent in enumerate(agents):
            identity = agent_id(self.robot, self.born)
            self.born += 1
            digest = genotype_digest(self.schema, agent.genes)
            births.append(Birth(identity, agent.mother, agent.father, digest, generation, step))
            self.ids[index] = identity
            self.genotypes[index] = agent.genes
        self.turns[:] = 0
        self.pool = []
        self.conceived = 0
        return births

    def save(self) -> dict[str, Any]:
        """Return all there is of the subpopulation, as plain data and copies."""
        return {
            "genotypes": self.genotypes.copy(),
            "ids": list(self.ids),
            "turns": self.turns.copy(),
            "pool": [(o.genes.copy(), o.mother, o.father, o.step) for o in self.pool],
            "conceived": self.conceived,
            "born": self.born,
        }

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Become a saved subpopulation; raises ValueError if it has other agents or genes."""
        if np.shape(saved["genotypes"]) != self.genotypes.shape:
            raise ValueError("the saved subpopulation has other agents or genes")
        self.genotypes[...] = saved["genotypes"]
        self.ids = list(saved["ids"])
        self.turns[...] = saved["turns"]
        self.pool = [Offspring(np.array(g), m, f, s) for g, m, f, s in saved["pool"]]
        self.conceived = saved["conceived"]
        self.born = saved["born"]
