"""Founders: genotypes of an earlier run with which robots begin, newborn, in place of random ones.

A founder's mother is the agent whose genotype it has, named so that no agent of its own run has the name:
`robot@population/number`, where `population` is a digest of all genotypes that were taken from that run. So lineages
connect across runs, and a run that is begun twice from the same genotypes has the same history.
"""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from crcolony.evolution.genotype import Gene, Normal, Schema, genotype_digest
from crcolony.evolution.history import Born
from crcolony.evolution.lineage import AgentId
from crcolony.evolution.population import NewAgent

_DIGEST_BYTES = 4
"""Of a population: it tells a few runs of one laboratory apart."""
_MAX_NAMED = 3
"""Genes that are named in a message, of every kind of difference."""


class FoundersError(ValueError):
    """Genotypes do not fit the schema of the robots that are to begin with them; the message names the genes."""


@dataclass(frozen=True, eq=False)
class Founders:
    """The subpopulations of the robots of an earlier run."""

    schema: str
    """The digest of the schema of their genes"""
    population: str
    """The digest of all genotypes that were taken from the run"""
    subpopulations: tuple[tuple[NewAgent, ...], ...]
    """One for each robot"""

    def of_robot(self, number: int, agents: int) -> list[NewAgent]:
        """Return the founders of the robot with this number, counted from 0.

        Where there are more robots, or more agents in a robot, than there were, they are dealt out again from the
        first; where there are fewer, it is the first ones.
        """
        dealt = self.subpopulations[number % len(self.subpopulations)]
        return [dealt[k % len(dealt)] for k in range(agents)]

    def share_of(self, number: int) -> "Founders":
        """Return what the robot with this number needs of them."""
        dealt = self.subpopulations[number % len(self.subpopulations)]
        return Founders(self.schema, self.population, (dealt,))


def make_founders(
    subpopulations: Sequence[Sequence[Born]], was: Schema, schema: Schema
) -> Founders:
    """Return the agents of an earlier run, given by their births, as founders of robots with this schema.

    `was` is the schema that the settings of the earlier run have now. Raises FoundersError if the genes differ.
    """
    difference = _difference(was, schema)
    if difference:
        raise FoundersError(difference)
    population = population_digest(subpopulations)
    for born in (born for subpopulation in subpopulations for born in subpopulation):
        genes = np.frombuffer(born.genes, dtype="<f8")
        if born.genotype != genotype_digest(schema, genes):
            raise FoundersError(
                f"agent {born.agent} has {len(genes)} genes of an earlier version of crcolony,"
                f" now there are {len(schema)}"
            )
        _check_fixed_genes(born.agent, genes, schema)
    return Founders(
        schema.digest,
        population,
        tuple(
            tuple(
                NewAgent(
                    np.frombuffer(born.genes, dtype="<f8"),
                    founder_name(born.agent, population),
                    None,
                )
                for born in subpopulation
            )
            for subpopulation in subpopulations
        ),
    )


def population_digest(subpopulations: Sequence[Sequence[Born]]) -> str:
    """Return a digest of the agents of all robots and their genotypes, as hex digits."""
    content = "\n".join(
        f"{born.agent} {born.genotype}"
        for subpopulation in subpopulations
        for born in subpopulation
    )
    return hashlib.blake2b(content.encode(), digest_size=_DIGEST_BYTES).hexdigest()


def founder_name(agent: AgentId, population: str) -> AgentId:
    """Return the name, in a later run, of an agent of a population of an earlier one."""
    robot, slash, number = agent.rpartition("/")
    return f"{robot}@{population}{slash}{number}"


def _difference(was: Schema, schema: Schema) -> str:
    """Return how two schemas differ, in words; empty if they do not."""
    before, now = ({gene.name: gene for gene in one.genes} for one in (was, schema))
    ranges = [
        f"{name} ({_format_range(before[name])} there, {_format_range(now[name])} here)"
        for name in before
        if name in now and _format_range(before[name]) != _format_range(now[name])
    ]
    parts = [
        f"{what}: {_format_some(names)}"
        for what, names in (
            ("only there", [name for name in before if name not in now]),
            ("only here", [name for name in now if name not in before]),
            ("in other ranges", ranges),
        )
        if names
    ]
    if not parts and was.digest != schema.digest:
        return "they are in another order"
    return "; ".join(parts)


def _check_fixed_genes(agent: AgentId, genes: np.ndarray, schema: Schema) -> None:
    """Raise FoundersError for a gene that evolution cannot change and that has another value than its fixed one."""
    wrong = [
        gene.name
        for gene, value in zip(schema.genes, genes, strict=True)
        if _is_fixed(gene) and isinstance(gene.initial, Normal) and value != gene.initial.mean
    ]
    if wrong:
        raise FoundersError(
            f"agent {agent} has values of genes that are switched off here: {_format_some(wrong)}"
        )


def _is_fixed(gene: Gene) -> bool:
    return isinstance(gene.initial, Normal) and gene.initial.sd == 0.0 == gene.mutation_sd


def _format_range(gene: Gene) -> str:
    return f"{gene.low:g} to {gene.high:g}"


def _format_some(names: Sequence[str]) -> str:
    others = len(names) - _MAX_NAMED
    return ", ".join(names[:_MAX_NAMED]) + (f" and {others} more" if others > 0 else "")
