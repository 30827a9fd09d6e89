"""Implicit selection: an offspring by the own energy, and the next agents from the pool."""

import numpy as np

from crcolony.evolution.implicit_selection import ImplicitSelection
from crcolony.randomness import generator
from tests.support.mating_pairs import STREAM, agent, subpopulation


def test_conceptions_follow_the_probability_of_the_energy() -> None:
    """Each side decides by its own."""
    own, partner = subpopulation("a", [1, 2, 3]), subpopulation("b", [-1, -2, -3])
    strategy, stream = ImplicitSelection(lambda energy: energy**2), STREAM.copy()
    offer = strategy.offer(agent(partner), stream)
    mother = agent(own, energy=0.5)
    conceived = [strategy.receive(mother, offer, stream) is not None for _ in range(2000)]
    assert abs(np.mean(conceived) - 0.25) < 0.04
    assert own.conceived == sum(conceived)


def test_the_next_agents_are_drawn_from_the_pool() -> None:
    """Their parents are those that mated."""
    own, partner = subpopulation("a", [1, 2, 3], [4, 5, 6]), subpopulation("b", [-1, -2, -3])
    strategy, stream = ImplicitSelection(lambda energy: energy), STREAM.copy()
    child = strategy.receive(agent(own, 1), strategy.offer(agent(partner), stream), stream)
    assert child is not None
    agents = strategy.next_agents(own, np.array([0, 1]), generator(stream))
    assert [(one.mother, one.father) for one in agents] == [("a/1", "b/0")] * 2
    assert all(one.genes is child.genes for one in agents)
