"""A subpopulation of virtual agents inside one robot: its offspring pool and its turnover (thesis 4.5, 5.3)."""

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
    """A genotype that waits in the pool for the next generation."""

    genes: FloatArray
    mother: AgentId
    father: AgentId
    step: int


@dataclass(frozen=True, eq=False)
class Newborn:
    """Genes about to be born, and of whom."""

    genes: FloatArray
    mother: AgentId | None
    father: AgentId | None


class Subpopulation:
    """The agents of one robot, and what they have conceived.

    `genotypes` (agents, genes) is written in place: it may be a row of a batch. The pool keeps at most `pool_limit`
    offspring; a conception beyond that takes the place of a random one, so that all had the same chance to stay.
    """

    def __init__(
        self,
        robot: str,
        schema: Schema,
        variation: Variation,
        genotypes: FloatArray,
        pool_limit: int,
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

    def first_children(self, rng: np.random.Generator) -> list[Newborn]:
        """Return random children, without parents, for the first generation."""
        return [Newborn(self.schema.random(rng), None, None) for _ in self.ids]

    def conceive(
        self,
        agent: int,
        partner_genes: FloatArray,
        partner: AgentId,
        step: int,
        rng: np.random.Generator,
    ) -> Offspring:
        """Make an offspring of an own agent and a partner's genotype, and put it into the pool."""
        own = self.genotypes[agent]
        genes = self.variation.offspring(own, partner_genes, self.schema, rng)
        offspring = Offspring(genes, self.ids[agent], partner, step)
        self.keep(offspring, rng)
        return offspring

    def keep(self, offspring: Offspring, rng: np.random.Generator) -> None:
        """Put an offspring into the pool; in a full one it takes the place of a random one, or is lost."""
        self.conceived += 1
        if len(self.pool) < self._pool_limit:
            self.pool.append(offspring)
        else:
            place = int(rng.integers(self.conceived))
            if place < self._pool_limit:
                self.pool[place] = offspring

    def draw_children(self, rng: np.random.Generator) -> list[Newborn]:
        """Return the next generation: as many draws with replacement from the pool as there are agents.

        Few offspring are drawn more often; if there is none, it is a mutated copy of the present generation.
        """
        if self.pool:
            drawn = [self.pool[k] for k in rng.integers(len(self.pool), size=len(self.ids))]
            return [Newborn(child.genes, child.mother, child.father) for child in drawn]
        return [
            Newborn(self.variation.mutant(genes, self.schema, rng), mother, None)
            for genes, mother in zip(self.genotypes, self.ids, strict=True)
        ]

    def bear(self, children: Sequence[Newborn], generation: int, step: int) -> list[Birth]:
        """Replace all agents by these children, name them, and empty the pool; return their births."""
        births = []
        for place, child in enumerate(children):
            name = agent_id(self.robot, self.born)
            self.born += 1
            digest = genotype_digest(self.schema, child.genes)
            births.append(Birth(name, child.mother, child.father, digest, generation, step))
            self.ids[place] = name
            self.genotypes[place] = child.genes
        self.turns[:] = 0
        self.pool = []
        self.conceived = 0
        return births

    def save(self) -> dict[str, Any]:
        """Return everything but the genotypes' owner as plain data and copies."""
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
