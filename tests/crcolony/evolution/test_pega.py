"""PEGA keeps the best string so far, and crosses it with that of a fitter partner: a table worked by hand."""

from typing import Any, cast

import numpy as np
import pytest

from crcolony.evolution.pega import Pega, RatedOffer
from crcolony.evolution.population import Subpopulation
from crcolony.evolution.reproduction import MatingOffer
from tests.support.mating_pairs import STREAM, agent, meet, subpopulation
from tests.support.scripted_randomness import ScriptedGenerator

NO_MUTATION = [[0.5] * 3, [0.0] * 3]
"""With a probability of 0 no gene mutates, whatever is drawn"""


def turn_over(own: Subpopulation, strategy: Pega, matings: int, script: list[Any]) -> list[float]:
    """Turn the only agent over; return its new genes."""
    generator = cast(Any, ScriptedGenerator(script))
    agents = strategy.next_agents(own, np.array([matings]), generator)
    own.replace_agents(agents, 1, 0)
    genes: list[float] = own.genotypes[0].tolist()
    return genes


def test_three_generations_go_as_in_the_table_worked_by_hand() -> None:
    """First better than before, then worse, then with a fitter partner."""
    own, partner = subpopulation("a", [1, 2, 3]), subpopulation("b", [-1, -2, -3])
    strategy, other = Pega(), Pega()
    # generation 0, 4 matings: the first string is the best; nobody fitter was met; it mutates, but none does here
    assert turn_over(own, strategy, 4, NO_MUTATION) == [1, 2, 3]
    # generation 1: another string, which mates 2 times: no improvement, so that the best one is used again
    own.genotypes[0] = [5, 5, 5]
    assert turn_over(own, strategy, 2, NO_MUTATION) == [1, 2, 3]
    # generation 2: a string with 6 matings is the best now; the last partner had 9 when this one had 6: crossed
    own.genotypes[0] = [7, 7, 7]
    meet((strategy, other), (agent(own, matings=6), agent(partner, matings=9)))
    swapped = [[0.9, 0.1, 0.9], *NO_MUTATION]  # the second gene is the partner's
    assert turn_over(own, strategy, 6, swapped) == [7, -2, 7]


@pytest.mark.parametrize(("fitness", "is_kept"), [(5, True), (3, False), (1, False)])
def test_only_a_fitter_partner_counts_and_only_the_last(fitness: int, is_kept: bool) -> None:
    """One that is as fit or less takes the place of an earlier, fitter one: nothing is kept."""
    own, partner = subpopulation("a", [1, 2, 3]), subpopulation("b", [-1, -2, -3])
    strategies = Pega(), Pega()
    meet(strategies, (agent(own, matings=2), agent(partner, matings=8)))
    assert [kept.father for kept in own.pool] == ["b/0"]
    meet(strategies, (agent(own, matings=3), agent(partner, matings=fitness)))
    assert bool(own.pool) == is_kept


def test_births_name_whose_string_it_was() -> None:
    """The mother is the agent that had the best string, however long ago; the father is the fitter partner."""
    own, partner = subpopulation("a", [1, 2, 3]), subpopulation("b", [-1, -2, -3])
    strategy = Pega()
    turn_over(own, strategy, 4, NO_MUTATION)
    meet((strategy, Pega()), (agent(own, matings=1), agent(partner, matings=2)))
    rng = cast(Any, ScriptedGenerator([[0.9] * 3, *NO_MUTATION]))
    (newborn,) = strategy.next_agents(own, np.array([1]), rng)
    assert (newborn.mother, newborn.father) == ("a/0", "b/0")


def test_a_saved_strategy_remembers_the_best_strings() -> None:
    """And one that is restored goes on as the other would have."""
    own, strategy, restored = subpopulation("a", [1, 2, 3]), Pega(), Pega()
    turn_over(own, strategy, 4, NO_MUTATION)
    restored.restore(strategy.save())
    own.genotypes[0] = [5, 5, 5]
    assert turn_over(own, restored, 2, NO_MUTATION) == [1, 2, 3]


def test_it_says_how_fit_it_is() -> None:
    """What nobody else of the colony does."""
    own = subpopulation("a", [1, 2, 3])
    offer = Pega().offer(agent(own, matings=3), STREAM)
    assert isinstance(offer, RatedOffer)
    assert offer.fitness == 3.0
    with pytest.raises(AssertionError):
        Pega().receive(agent(own), MatingOffer("b/0", own.genotypes[0]), STREAM)
