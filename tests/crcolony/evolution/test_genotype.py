"""A genotype is numbers under a schema that names and bounds each, identified by its content."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crcolony.evolution.genotype import (
    Gene,
    Genotype,
    GenotypeError,
    Normal,
    Schema,
    Uniform,
    genotype_digest,
)

SCHEMA = Schema(
    (
        Gene("bias", initial=Normal(0.0, 0.5), mutation_sd=0.3),
        Gene("alpha", 0.0, 1.0, Uniform(0.0, 1.0)),
        Gene("gamma", 0.0, 0.999, Normal(1.0, 5.0)),
    )
)
GENES = np.array([-3.0, 0.5, 0.999])


def test_genes_are_read_by_name() -> None:
    """An unknown name raises KeyError."""
    genotype = Genotype(SCHEMA, GENES)
    assert genotype["bias"] == -3.0
    assert genotype["gamma"] == 0.999
    assert len(SCHEMA) == 3
    with pytest.raises(KeyError, match="lambda"):
        genotype["lambda"]


def test_bounds_and_deviations_are_those_of_the_genes() -> None:
    """They are read-only arrays in the order of the genes."""
    assert SCHEMA.lows.tolist() == [-math.inf, 0.0, 0.0]
    assert SCHEMA.highs.tolist() == [math.inf, 1.0, 0.999]
    assert SCHEMA.mutation_sds.tolist() == [0.3, 0.1, 0.1]
    with pytest.raises(ValueError):
        SCHEMA.lows[0] = 0.0


def test_a_genotype_cannot_change() -> None:
    """Neither its own array nor the one that it was made from changes it."""
    genes = GENES.copy()
    genotype = Genotype(SCHEMA, genes)
    genes[0] = 7.0
    assert genotype["bias"] == -3.0
    with pytest.raises(ValueError):
        genotype.genes[0] = 7.0


@given(st.integers(0, 2), st.floats(0.001, 0.9))
def test_a_change_of_any_gene_changes_the_digest(index: int, value: float) -> None:
    """Two genotypes are equal if their digests are."""
    genes = GENES.copy()
    genes[index] = value
    one, other = Genotype(SCHEMA, GENES), Genotype(SCHEMA, genes)
    changed = value != GENES[index]
    assert (one.digest != other.digest) == changed
    assert (one != other) == changed
    assert len({one, other}) == 1 + changed
    assert other.digest == genotype_digest(SCHEMA, genes)


def test_a_digest_depends_on_content_alone() -> None:
    """The digest is of the numbers, names and ranges, not of the memory layout of the array."""
    wide = np.zeros((3, 2))
    wide[:, 0] = GENES
    assert genotype_digest(SCHEMA, wide[:, 0]) == genotype_digest(SCHEMA, GENES)
    renamed = Schema((*SCHEMA.genes[:2], Gene("lambda", 0.0, 0.999)))
    wider = Schema((*SCHEMA.genes[:2], Gene("gamma", 0.0, 0.9991)))
    for other in (renamed, wider):
        assert genotype_digest(other, GENES) != genotype_digest(SCHEMA, GENES)
    assert Genotype(SCHEMA, GENES) != GENES.tolist()


def test_robots_with_other_initial_and_mutation_settings_can_mate() -> None:
    """The digest of a schema is of names and ranges only."""
    other = Schema(tuple(Gene(gene.name, gene.low, gene.high) for gene in SCHEMA.genes))
    assert other.digest == SCHEMA.digest


@pytest.mark.parametrize(
    ("genes", "message"),
    [
        ([0.0, 0.5], "expected 3 genes"),
        ([[0.0, 0.5, 0.5]], "expected 3 genes"),
        ([0.0, 1.5, 0.5], "gene alpha: 1.5 is not within 0.0 to 1.0"),
        ([0.0, 0.5, -0.1], "gene gamma: -0.1"),
        ([math.nan, 0.5, 0.5], "gene bias: nan"),
        ([math.inf, 0.5, 0.5], "gene bias: inf"),
    ],
)
def test_genes_that_do_not_fit_are_refused_by_name(genes: list[float], message: str) -> None:
    """The message has the wrong length, or the name of the gene that is out of range or not
    finite."""
    with pytest.raises(GenotypeError, match=message):
        Genotype(SCHEMA, np.array(genes))


def test_an_impossible_schema_is_refused() -> None:
    """Two genes of one name, or an empty range, raise ValueError."""
    with pytest.raises(ValueError, match="two genes are named a"):
        Schema((Gene("a"), Gene("b"), Gene("a")))
    with pytest.raises(ValueError, match="gene a: empty range"):
        Schema((Gene("a", 1.0, 0.0),))


def test_initial_genes_have_their_distribution_and_lie_within_their_range() -> None:
    """Normal and uniform ones have the right moments; a value beyond its range is set to the
    bound."""
    rng = np.random.default_rng(1)
    drawn = np.array([SCHEMA.random(rng) for _ in range(4000)])
    for genes in drawn[:100]:
        SCHEMA.validate(genes)
    assert abs(drawn[:, 0].mean()) < 0.04
    assert drawn[:, 0].std() == pytest.approx(0.5, rel=0.05)
    assert drawn[:, 1].mean() == pytest.approx(0.5, abs=0.02)
    assert drawn[:, 1].min() < 0.01 < 0.99 < drawn[:, 1].max()
    assert {0.0, 0.999} <= set(drawn[:, 2])
