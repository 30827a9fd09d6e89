"""GPBT-PL, population-based training with pairwise learning (Bai and Cheng 2024, arXiv 2404.08233).

As their released code has it (github.com/EMI-Group/gpbt-pl, d9f93e1, synchronous): the worst quarter of the instances
learn from one of the best quarter each, drawn at random. An instance takes over what the other has learnt, and moves
each of its meta-parameters x towards the other's y with a velocity v: v = r1 v + r2 (y - x), x = x + v, where r1 and
r2 are uniform in 0 to 1; or, with a probability of a quarter, draws it anew. All other instances go on as they are.
"""

import numpy as np

from crcolony.compiled import FloatArray, IntArray
from crcolony.evolution.genotype import Schema

QUANTILE = 0.25
"""The share of instances that learn, and that are learnt from."""
RESAMPLE_PROBABILITY = 0.25


def pairs(
    fitness: FloatArray, rng: np.random.Generator, quantile: float = QUANTILE
) -> tuple[IntArray, IntArray]:
    """Return the instances of `fitness` (N,) that learn, and the one that each of them learns from."""
    order = np.argsort(fitness, kind="stable")
    count = min(int(np.ceil(fitness.size * quantile)), fitness.size // 2)
    slow, fast = order[:count], order[fitness.size - count :]
    return slow, fast[rng.integers(max(count, 1), size=count)]


def next_velocity(
    velocity: FloatArray, slow: FloatArray, fast: FloatArray, inertia: FloatArray, pull: FloatArray
) -> FloatArray:
    """Return the velocity with which meta-parameters move; all arrays have one shape, r1 is `inertia`, r2 `pull`."""
    return inertia * velocity + pull * (fast - slow)


class GpbtPl:
    """Pairwise learning, as a rule of `crcolony.in_process.lamarckian_selection`."""

    def __init__(self, schema: Schema, instances: int) -> None:
        self._schema = schema
        self.memory: FloatArray = np.zeros((instances, len(schema)))
        """The velocity of every meta-parameter, (N, genes)"""

    def compete(
        self, genotypes: FloatArray, fitness: FloatArray, rng: np.random.Generator
    ) -> tuple[IntArray, FloatArray]:
        """Return whose learning each instance goes on with, (N,), and its meta-parameters, (N, genes)."""
        learnt_from, genes = np.arange(fitness.size), genotypes.copy()
        slow, fast = pairs(fitness, rng)
        learnt_from[slow] = fast
        shape = (slow.size, len(self._schema))
        velocity = next_velocity(
            self.memory[slow],
            genotypes[slow],
            genotypes[fast],
            rng.random(shape),
            rng.random(shape),
        )
        moved = np.clip(genotypes[slow] + velocity, self._schema.lows, self._schema.highs)
        anew = np.stack([self._schema.random(rng) for _ in slow]) if slow.size else moved
        is_anew = rng.random(shape) < RESAMPLE_PROBABILITY
        genes[slow] = np.where(is_anew, anew, moved)
        self.memory[slow] = np.where(is_anew, self.memory[fast], velocity)
        return learnt_from, genes
