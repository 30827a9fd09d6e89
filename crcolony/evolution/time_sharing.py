"""Time sharing (thesis 4.5; 6.1 after Whiteson and Stone 2006): the next agent in control."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from crcolony.compiled import FloatArray, IntArray


class TimeSharing(Protocol):
    """Chooses the next agent by the slices and the performance of the own agents; it has no
    state."""

    def next_agent(
        self, turns: IntArray, performance: FloatArray, rng: np.random.Generator
    ) -> int | None:
        """Return the next agent, or None when the generation is over.

        `turns` (agents,) are the slices that each has had, `performance` (agents,) its matings per
        step alive, or less than 0 if it is dead.
        """
        ...


@dataclass(frozen=True)
class RandomOrder:
    """Every agent has one slice in each round, in random order (Papers II and III)."""

    rounds: int

    def next_agent(
        self, turns: IntArray, performance: FloatArray, rng: np.random.Generator
    ) -> int | None:
        """Return a random agent of those that have had the fewest slices."""
        fewest = turns.min()
        if fewest >= self.rounds:
            return None
        return _any_of(np.flatnonzero(turns == fewest), rng)


@dataclass(frozen=True)
class EpsilonGreedyOrder:
    """After one slice each, mostly the agent that performs best; a generation has as many slices as
    in rounds."""

    rounds: int
    epsilon: float

    def next_agent(
        self, turns: IntArray, performance: FloatArray, rng: np.random.Generator
    ) -> int | None:
        """Return an agent without a slice while there is one, then the best, or with probability
        epsilon any."""
        if turns.sum() >= self.rounds * turns.size:
            return None
        if turns.min() == 0:
            return _any_of(np.flatnonzero(turns == 0), rng)
        if rng.random() < self.epsilon:
            return int(rng.integers(turns.size))
        return _any_of(np.flatnonzero(performance == performance.max()), rng)


@dataclass(frozen=True)
class SoftmaxOrder:
    """After one slice each, agents by a Boltzmann distribution over their performance relative to
    the best."""

    rounds: int
    temperature: float

    def next_agent(
        self, turns: IntArray, performance: FloatArray, rng: np.random.Generator
    ) -> int | None:
        """Return an agent without a slice while there is one, then one drawn by performance;
        temperature 0 is greedy."""
        if turns.sum() >= self.rounds * turns.size:
            return None
        if turns.min() == 0:
            return _any_of(np.flatnonzero(turns == 0), rng)
        best = performance.max()
        if self.temperature == 0.0 or best <= 0.0:
            return _any_of(np.flatnonzero(performance == best), rng)
        odds = np.exp((performance / best - 1.0) / self.temperature)
        return int(rng.choice(turns.size, p=odds / odds.sum()))


def _any_of(agents: IntArray, rng: np.random.Generator) -> int:
    """Return one of the agents, the one that `rng.choice` would, in a sixth of its time."""
    return int(agents[rng.integers(agents.size)])
