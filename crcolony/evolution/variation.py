"""Crossover and mutation (thesis 4.1): how an offspring comes to differ from its parents."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from crcolony.compiled import FloatArray
from crcolony.evolution.genotype import Schema

Crossover = Callable[[FloatArray, FloatArray, np.random.Generator], tuple[FloatArray, FloatArray]]
"""Makes two children (genes,) of two parents (genes,), which stay as they are."""


def one_point_crossover(
    first: FloatArray, second: FloatArray, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Swap all genes after a random point (thesis Figure 4.1)."""
    point = int(rng.integers(1, max(2, first.size)))
    return _swap(first, second, point, first.size)


def two_point_crossover(
    first: FloatArray, second: FloatArray, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Swap a random segment of one gene or more, at most all."""
    start, end = sorted(rng.integers(0, first.size, 2).tolist())
    return _swap(first, second, start, end + 1)


def uniform_crossover(
    first: FloatArray, second: FloatArray, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Swap every gene with probability one half."""
    swapped = rng.random(first.size) < 0.5
    return np.where(swapped, second, first), np.where(swapped, first, second)


def _swap(
    first: FloatArray, second: FloatArray, start: int, end: int
) -> tuple[FloatArray, FloatArray]:
    one, other = first.copy(), second.copy()
    one[start:end], other[start:end] = second[start:end], first[start:end]
    return one, other


CROSSOVERS: dict[str, Crossover] = {
    "one_point": one_point_crossover,
    "two_point": two_point_crossover,
    "uniform": uniform_crossover,
}


def gaussian_mutation(
    genes: FloatArray, schema: Schema, probability: float, rng: np.random.Generator
) -> FloatArray:
    """Return a copy in which each gene has moved with a probability, by its own deviation, within
    its range."""
    mutated = rng.random(genes.size) < probability
    moved = genes + mutated * schema.mutation_sds * rng.standard_normal(genes.size)
    return np.minimum(np.maximum(moved, schema.lows), schema.highs)


def bit_flip(
    bits: NDArray[np.bool_], probability: float, rng: np.random.Generator
) -> NDArray[np.bool_]:
    """Return a copy of a bit string in which each bit has flipped with a probability."""
    flipped: NDArray[np.bool_] = bits ^ (rng.random(bits.size) < probability)
    return flipped


@dataclass(frozen=True)
class Variation:
    """How offspring are made: a crossover by name, and the probability that a gene mutates.

    Raises ValueError for an unknown crossover or a probability outside 0 to 1.
    """

    crossover: str
    mutation_probability: float

    def __post_init__(self) -> None:
        if self.crossover not in CROSSOVERS:
            raise ValueError(f"unknown crossover {self.crossover}")
        if not 0.0 <= self.mutation_probability <= 1.0:
            raise ValueError(f"not a probability: {self.mutation_probability}")

    def offspring(
        self, own: FloatArray, partner: FloatArray, schema: Schema, rng: np.random.Generator
    ) -> FloatArray:
        """Return the own genotype with a part of the partner's, mutated; all genes are (genes,)."""
        child, _ = CROSSOVERS[self.crossover](own, partner, rng)
        return self.mutant(child, schema, rng)

    def mutant(self, own: FloatArray, schema: Schema, rng: np.random.Generator) -> FloatArray:
        """Return a mutated copy of the own genotype (genes,)."""
        return gaussian_mutation(own, schema, self.mutation_probability, rng)
