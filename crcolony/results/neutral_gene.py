"""The null of a neutral gene: what would become of a gene by chance alone, without any effect on the agents.

Over 250 generations of 80 agents a gene without any effect drifts far from where it began, and agents become alike in
it; a meta-parameter that has moved is not yet one that was selected. So a neutral gene with the same initial
distribution, range, crossover and mutation as a meta-parameter is passed on along the true pedigree of a run, again and
again: parents and offspring are those of the run, but what is inherited and how it mutates is drawn anew.

With uniform crossover this is exact. With one-point and two-point crossover the gene comes from each parent as often as
its neighbours do, but is not linked to them.
"""

from collections.abc import Callable, Sequence

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.config import Config
from crcolony.evolution.genotype import Gene, Normal
from crcolony.results.pedigree import NOBODY, Pedigree
from crcolony.robot.genes import agent_schema

REPLICATES = 200
"""Neutral genes of a run: enough for its quantiles of 5 and 95 %."""
QUANTILES = (0.05, 0.95)
"""The band of a neutral gene lies between these."""

PARTNER_SHARES: dict[str, Callable[[int, int], float]] = {
    "one_point": lambda index, size: index / max(size - 1, 1),
    "two_point": lambda index, size: 1.0 - (index / size) ** 2 - ((size - 1 - index) / size) ** 2,
    "uniform": lambda index, size: 0.5,
}
"""The probability that the gene of an index, of so many genes, comes from the partner, by the name of the crossover."""


def replay(
    pedigree: Pedigree,
    gene: Gene,
    partner_share: float,
    mutation_probability: float,
    rng: np.random.Generator,
) -> FloatArray:
    """Return the values of neutral genes, (agents, replicates), that are passed on along a pedigree."""
    values = np.empty((pedigree.mother.size, REPLICATES))
    for layer in pedigree.layers:
        conceived = layer[pedigree.offspring[layer] == layer]
        mothers, fathers = pedigree.mother[conceived], pedigree.father[conceived]
        shape = (conceived.size, REPLICATES)
        if (mothers == NOBODY).all():
            values[conceived] = _initial(gene, shape, rng)
            continue
        is_fathers = (rng.random(shape) < partner_share) & (fathers != NOBODY)[:, None]
        inherited = np.where(is_fathers, values[fathers], values[mothers])
        has_mutated = rng.random(shape) < mutation_probability
        inherited += has_mutated * gene.mutation_sd * rng.standard_normal(shape)
        values[conceived] = np.clip(inherited, gene.low, gene.high)
        values[layer] = values[pedigree.offspring[layer]]
    return values


def _initial(gene: Gene, shape: tuple[int, int], rng: np.random.Generator) -> FloatArray:
    if isinstance(gene.initial, Normal):
        drawn = rng.normal(gene.initial.mean, gene.initial.sd, shape)
    else:
        drawn = rng.uniform(gene.initial.low, gene.initial.high, shape)
    return np.clip(drawn, gene.low, gene.high)


def neutral_medians(
    pedigree: Pedigree, config: Config, names: Sequence[str]
) -> dict[str, FloatArray]:
    """Return, for genes by name, the median over agents of neutral genes in their place, (generations, replicates).

    A median over agents is what the tables of a run have of a meta-parameter. Genes of the same law have the same
    replicates.
    """
    schema = agent_schema(config.learning, config.heredity)
    share_of = PARTNER_SHARES[config.heredity.crossover]
    replayed: dict[tuple[object, ...], FloatArray] = {}
    medians = {}
    for name in names:
        index = schema.index(name)
        gene, share = schema.genes[index], share_of(index, len(schema))
        law = (gene.initial, gene.low, gene.high, gene.mutation_sd, share)
        if law not in replayed:
            rng = np.random.default_rng([config.seed, len(replayed)])
            probability = config.heredity.mutation_probability
            replayed[law] = _medians(pedigree, replay(pedigree, gene, share, probability, rng))
        medians[name] = replayed[law]
    return medians


def _medians(pedigree: Pedigree, values: FloatArray) -> FloatArray:
    generations = range(int(pedigree.generation.max()) + 1)
    return np.stack(
        [np.median(values[pedigree.generation == generation], axis=0) for generation in generations]
    )
