"""Roulette wheel (eq. 4.1) and tournament selection, for the central baseline only."""

import numpy as np

from crcolony.compiled import FloatArray, IntArray


def roulette(fitness: FloatArray, count: int, rng: np.random.Generator) -> IntArray:
    """Return `count` indices drawn in proportion to `fitness` (N,) (eq. 4.1); uniformly if all
    fitness is 0.

    Raises ValueError for a fitness that is negative or not finite.
    """
    if not np.isfinite(fitness).all() or (fitness < 0.0).any():
        raise ValueError("roulette needs finite fitness of 0 or more")
    wheel = np.cumsum(fitness if fitness.any() else np.ones_like(fitness))
    spins = rng.random(count) * wheel[-1]
    return np.asarray(np.searchsorted(wheel, spins, side="right"), dtype=np.int64)


def tournament(fitness: FloatArray, count: int, size: int, rng: np.random.Generator) -> IntArray:
    """Return `count` indices, each of the fittest of `size` individuals drawn uniformly with
    replacement.

    Raises ValueError for a size below 1.
    """
    if size < 1:
        raise ValueError(f"a tournament needs one individual or more, not {size}")
    entrants = rng.integers(fitness.size, size=(count, size))
    winners = np.argmax(fitness[entrants], axis=1)
    return np.asarray(entrants[np.arange(count), winners], dtype=np.int64)
