"""A strategy without memory sends a genotype as it is; robots that are bred centrally have no offspring."""

import numpy as np
import pytest

from crcolony.evolution.reproduction import CentrallyBred, MatingOffer
from crcolony.randomness import generator
from tests.support.mating_pairs import STREAM, agent, subpopulation


def test_an_offer_is_a_name_and_a_genotype() -> None:
    """It draws nothing, and there is nothing to save."""
    own, stream = subpopulation("a", [1, 2, 3], [4, 5, 6]), STREAM.copy()
    strategy = CentrallyBred()
    offer = strategy.offer(agent(own, 1), stream)
    assert (offer.agent, offer.genes.tolist()) == ("a/1", [4, 5, 6])
    assert np.array_equal(stream, STREAM)
    assert strategy.save() == {}
    strategy.restore({})


def test_an_agents_genes_are_those_in_effect() -> None:
    """What is written to them is written to the subpopulation."""
    own = subpopulation("a", [1, 2, 3])
    agent(own).genes[1] = 9.0
    assert own.genotypes[0].tolist() == [1, 9, 3]


def test_robots_that_are_bred_centrally_conceive_nothing() -> None:
    """And have no next agents of their own, however many matings."""
    own, stream = subpopulation("a", [1, 2, 3]), STREAM.copy()
    strategy = CentrallyBred()
    assert strategy.receive(agent(own), MatingOffer("b/0", np.zeros(3)), stream) is None
    assert own.pool == []
    with pytest.raises(AssertionError):
        strategy.next_agents(own, np.array([5]), generator(stream))
