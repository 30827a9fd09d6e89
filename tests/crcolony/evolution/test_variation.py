"""Crossover swaps the genes of parents; mutation moves genes by the deviations of the schema."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from crcolony.evolution.genotype import Gene, Schema
from crcolony.evolution.variation import (
    CROSSOVERS,
    Crossover,
    Variation,
    bit_flip,
    gaussian_mutation,
    one_point_crossover,
    two_point_crossover,
    uniform_crossover,
)

SIZE = 40
SCHEMA = Schema(tuple(Gene(f"g{k}", -5.0, 5.0, mutation_sd=0.1 * (k + 1)) for k in range(SIZE)))


@given(st.sampled_from(sorted(CROSSOVERS)), st.integers(0, 2**32), st.integers(1, 20))
def test_crossover_conserves_the_genes_at_every_index(name: str, seed: int, size: int) -> None:
    """At each index the two children have the genes of the two parents, who are unchanged."""
    rng = np.random.default_rng(seed)
    parents = rng.normal(size=(2, size))
    kept = parents.copy()
    children = np.array(CROSSOVERS[name](parents[0], parents[1], rng))
    assert np.array_equal(np.sort(children, axis=0), np.sort(parents, axis=0))
    assert np.array_equal(parents, kept)


def swapped(crossover: Crossover, rng: np.random.Generator, size: int = SIZE) -> NDArray[np.bool_]:
    """Return which genes of the first child come from the second parent."""
    return np.asarray(crossover(np.zeros(size), np.ones(size), rng)[0] == 1.0)


def test_one_point_crossover_swaps_a_tail() -> None:
    """The tail starts at every point between two genes with the same probability."""
    rng = np.random.default_rng(2)
    points = []
    for _ in range(3900):
        tail = swapped(one_point_crossover, rng)
        point = int(np.argmax(tail))
        assert not tail[:point].any()
        assert tail[point:].all()
        points.append(point)
    counts = np.bincount(points, minlength=SIZE)
    assert counts[0] == 0
    assert ((counts[1:] - 100) ** 2 / 100).sum() < 80  # chi square of 38 degrees, p about 1e-4


def test_two_point_crossover_swaps_a_segment() -> None:
    """A segment is a run of genes, from a single one to all of them."""
    rng = np.random.default_rng(3)
    lengths = set()
    for _ in range(5000):
        segment = swapped(two_point_crossover, rng, 6)
        edges = np.flatnonzero(np.diff(np.concatenate([[0], segment.astype(int), [0]])))
        assert edges.size == 2
        lengths.add(int(segment.sum()))
    assert lengths == {1, 2, 3, 4, 5, 6}


def test_uniform_crossover_swaps_genes_independently() -> None:
    """Half of them on average, neighbours independently of each other."""
    rng = np.random.default_rng(4)
    masks = np.array([swapped(uniform_crossover, rng) for _ in range(2000)])
    assert masks.mean() == pytest.approx(0.5, abs=0.01)
    together = (masks[:, 1:] == masks[:, :-1]).mean()
    assert together == pytest.approx(0.5, abs=0.01)


def test_mutation_moves_a_share_of_the_genes_by_their_own_deviation() -> None:
    """A mutated gene's change has the standard deviation of its schema; the others stay."""
    rng = np.random.default_rng(5)
    moves = np.array([gaussian_mutation(np.zeros(SIZE), SCHEMA, 0.1, rng) for _ in range(20_000)])
    assert (moves != 0.0).mean() == pytest.approx(0.1, abs=0.002)
    for index in (0, 4, 9):
        moved = moves[:, index][moves[:, index] != 0.0]
        assert moved.std() == pytest.approx(0.1 * (index + 1), rel=0.06)
        assert abs(moved.mean()) < 0.1 * (index + 1) * 0.1


@given(st.integers(0, 2**32), st.floats(0.0, 1.0))
def test_a_mutant_lies_within_its_schema(seed: int, probability: float) -> None:
    """Also if its parent is at the bound; the parent is unchanged."""
    rng = np.random.default_rng(seed)
    genes = rng.choice([-5.0, 5.0, 0.0], SIZE)
    kept = genes.copy()
    SCHEMA.validate(gaussian_mutation(genes, SCHEMA, probability, rng))
    assert np.array_equal(genes, kept)


def test_without_mutation_a_mutant_is_a_copy() -> None:
    """With probability 0 no gene changes."""
    genes = np.linspace(-5.0, 5.0, SIZE)
    assert np.array_equal(gaussian_mutation(genes, SCHEMA, 0.0, np.random.default_rng(6)), genes)


def test_bits_flip_with_their_probability() -> None:
    """Never, always, or some of them, and the parent is unchanged."""
    rng = np.random.default_rng(7)
    bits = rng.random(10_000) < 0.3
    kept = bits.copy()
    assert np.array_equal(bit_flip(bits, 0.0, rng), bits)
    assert np.array_equal(bit_flip(bits, 1.0, rng), ~bits)
    assert (bit_flip(bits, 0.2, rng) != bits).mean() == pytest.approx(0.2, abs=0.02)
    assert np.array_equal(bits, kept)


def test_an_offspring_has_genes_of_both_parents() -> None:
    """Without mutation every gene is of one of the two parents, and both have a share."""
    variation = Variation("two_point", 0.0)
    rng = np.random.default_rng(8)
    child = variation.offspring(np.zeros(SIZE), np.ones(SIZE), SCHEMA, rng)
    assert set(child) == {0.0, 1.0}
    assert np.array_equal(variation.mutant(np.ones(SIZE), SCHEMA, rng), np.ones(SIZE))


def test_an_impossible_variation_is_refused() -> None:
    """An unknown crossover, or a probability above 1, raises ValueError."""
    with pytest.raises(ValueError, match="three_point"):
        Variation("three_point", 0.1)
    with pytest.raises(ValueError, match="not a probability"):
        Variation("uniform", 1.1)
