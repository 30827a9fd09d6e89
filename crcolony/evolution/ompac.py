"""OMPAC, online meta-learning by parallel algorithm competition (Elfwing, Uchibe and Doya 2017, arXiv 1702.07490).

Instances of a learning algorithm run in parallel. After a fixed time they are selected by their performance, with all
they have learnt; Gaussian noise is added to each meta-parameter with a probability; and they go on learning. It is
Lamarckian and central. Its abstract does not say how instances are selected: here by stochastic universal sampling.
"""

from collections.abc import Callable

import numpy as np

from crcolony.compiled import FloatArray, IntArray


def universal_sampling(fitness: FloatArray, spin: float) -> IntArray:
    """Return N indices of `fitness` (N,), each as often as its share of the sum, rounded up or down (Baker 1987).

    `spin`, from 0 to 1, turns a wheel with N evenly spaced pointers. If all fitness is 0, everyone is selected once.
    """
    wheel = np.cumsum(fitness if fitness.any() else np.ones_like(fitness))
    pointers = (np.arange(fitness.size) + spin) * wheel[-1] / fitness.size
    return np.asarray(np.searchsorted(wheel, pointers, side="right"), dtype=np.int64)


class Ompac:
    """The competition, as a rule of `crcolony.in_process.lamarckian_selection`."""

    def __init__(
        self, add_noise: Callable[[FloatArray, np.random.Generator], FloatArray], instances: int
    ) -> None:
        self._add_noise = add_noise
        self.memory: FloatArray = np.zeros((instances, 0))
        """Nothing"""

    def compete(
        self, genotypes: FloatArray, fitness: FloatArray, rng: np.random.Generator
    ) -> tuple[IntArray, FloatArray]:
        """Return whose learning each instance goes on with, (N,), and its meta-parameters, (N, genes)."""
        selected = universal_sampling(fitness, rng.random())
        return selected, np.stack([self._add_noise(genotypes[k], rng) for k in selected])
