"""A neutral gene is passed on as any gene is, and a gene without effect lies in its band as often as it says."""

from pathlib import Path

import msgspec
import numpy as np
import pytest
from scipy import stats

from crcolony.config import Config
from crcolony.evolution.genotype import Gene, Normal, Schema, Uniform
from crcolony.evolution.variation import CROSSOVERS, Variation
from crcolony.results.generation_table import read_table
from crcolony.results.neutral_gene import (
    PARTNER_SHARES,
    QUANTILES,
    REPLICATES,
    neutral_medians,
    replay,
)
from crcolony.results.pedigree import NOBODY, Pedigree, pedigree_of, read_pedigree
from tests.support.run_folders import run
from tests.support.small_colony import small

GENES = 7


def random_pedigree(agents: int = 10, generations: int = 6) -> Pedigree:
    """Return a pedigree in which few agents have most offspring, some copies, and some offspring drawn twice."""
    rng = np.random.default_rng(1)
    births: list[tuple[str, int, str, str | None, str | None]] = [
        (f"0/{k}", 0, f"g{k}", None, None) for k in range(agents)
    ]
    for generation in range(1, generations):
        parents = births[-agents:]
        for k in range(agents):
            mother, father = (parents[int(agents * rng.random() ** 2)][0] for _ in range(2))
            name = f"{generation}/{k}"
            if rng.random() < 0.2:
                births.append((name, generation, name, mother, None))
            elif rng.random() < 0.3 and births[-1][1] == generation:
                births.append((name, generation, *births[-1][2:]))
            else:
                births.append((name, generation, name, mother, father))
    return pedigree_of(births)


def simulate(
    pedigree: Pedigree, schema: Schema, variation: Variation, rng: np.random.Generator
) -> np.ndarray:
    """Return the genes of all agents, (agents, genes), born one by one as a subpopulation lets them be born."""
    genes = np.empty((pedigree.mother.size, len(schema)))
    for index, (mother, father) in enumerate(zip(pedigree.mother, pedigree.father, strict=True)):
        if pedigree.offspring[index] != index:
            genes[index] = genes[pedigree.offspring[index]]
        elif mother == NOBODY:
            genes[index] = schema.random(rng)
        elif father == NOBODY:
            genes[index] = variation.mutant(genes[mother], schema, rng)
        else:
            genes[index] = variation.offspring(genes[mother], genes[father], schema, rng)
    return genes


@pytest.mark.parametrize("crossover", sorted(CROSSOVERS))
@pytest.mark.parametrize("index", [0, 3])
def test_replays_are_distributed_as_a_simulation_of_whole_genotypes(
    crossover: str, index: int
) -> None:
    """The median of the last generation, and the difference of two agents (Kolmogorov and Smirnov)."""
    pedigree = random_pedigree()
    gene = Gene("neutral", 0.0, 1.0, Uniform(0.0, 1.0), 0.15)
    schema = Schema(tuple(Gene(f"g{k}", 0.0, 1.0, gene.initial, 0.15) for k in range(GENES)))
    rng = np.random.default_rng(2)
    slow = np.array(
        [
            simulate(pedigree, schema, Variation(crossover, 0.1), rng)[-10:, index]
            for _ in range(400)
        ]
    )
    share = PARTNER_SHARES[crossover](index, GENES)
    fast = np.hstack([replay(pedigree, gene, share, 0.1, rng)[-10:] for _ in range(2)]).T
    assert fast.shape == (2 * REPLICATES, 10)
    for measure in (np.median(slow, 1), slow[:, 0] - slow[:, 7]):
        other = np.median(fast, 1) if measure.min() >= 0.0 else fast[:, 0] - fast[:, 7]
        assert stats.ks_2samp(measure, other).pvalue > 1e-3


@pytest.mark.parametrize("crossover", sorted(CROSSOVERS))
def test_the_partners_share_is_that_of_the_crossover(crossover: str) -> None:
    """At every index, within sampling error."""
    rng = np.random.default_rng(3)
    swapped = np.mean(
        [CROSSOVERS[crossover](np.zeros(GENES), np.ones(GENES), rng)[0] for _ in range(6000)],
        axis=0,
    )
    shares = [PARTNER_SHARES[crossover](index, GENES) for index in range(GENES)]
    assert swapped == pytest.approx(shares, abs=0.03)
    assert PARTNER_SHARES[crossover](0, 1) in (0.0, 0.5, 1.0)


def test_agents_of_one_offspring_have_one_gene_and_founders_are_drawn_anew() -> None:
    """Also normal genes, within their range."""
    pedigree = random_pedigree()
    gene = Gene("neutral", -1.0, 1.0, Normal(0.0, 2.0), 0.3)
    values = replay(pedigree, gene, 0.5, 0.1, np.random.default_rng(4))
    twice = np.flatnonzero(pedigree.offspring != np.arange(pedigree.offspring.size))
    assert twice.size > 3
    assert np.array_equal(values[twice], values[pedigree.offspring[twice]])
    assert len(np.unique(values[:10][np.abs(values[:10]) < 1.0])) > 700
    assert values.min() == -1.0
    assert values.max() == 1.0


def test_genes_of_the_same_law_have_the_same_replicates() -> None:
    """They are replayed once; a gene of another range is not among them, and a seed gives the same again."""
    config = msgspec.structs.replace(Config(), seed=5)
    uniform = msgspec.structs.replace(config.heredity, crossover="uniform")
    config = msgspec.structs.replace(config, heredity=uniform)
    names = ["mating.lambda", "foraging.lambda", "mating.gamma"]
    medians = neutral_medians(random_pedigree(), config, names)
    assert medians["mating.lambda"] is medians["foraging.lambda"]
    assert not np.array_equal(medians["mating.lambda"], medians["mating.gamma"])
    assert medians["mating.lambda"].shape == (6, REPLICATES)
    again = neutral_medians(random_pedigree(), config, names)
    assert np.array_equal(again["mating.gamma"], medians["mating.gamma"])


@pytest.mark.slow
def test_genes_that_have_no_effect_lie_outside_of_the_band_one_time_in_ten(tmp_path: Path) -> None:
    """In colonies that evolve and do not learn (α is 0) no other meta-parameter has an effect."""
    metas = ("gamma", "lambda", "tau", "tau_decay")
    names = [f"{module}.{meta}" for module in ("foraging", "mating") for meta in metas]
    outside = []
    for seed in range(1, 25):
        config = small(f"seed={seed}", "generations=8", "heredity.highest_alpha=0")
        run(tmp_path / str(seed), config)
        last = read_table(tmp_path / str(seed) / "generations.csv")[-1]
        medians = neutral_medians(read_pedigree(tmp_path / str(seed)), config, names)
        for name in names:
            low, high = np.quantile(medians[name][7], QUANTILES)
            outside.append(not low <= float(last[f"{name} q50"]) <= high)
    assert stats.binomtest(sum(outside), len(outside), 0.1).pvalue > 1e-3
