"""PEGA keeps the best string so far, and crosses with fitter partners: a table worked by hand."""

from typing import Any, cast

import numpy as np
import pytest

from crcolony.evolution.pega import Pega, RatedOffer
from crcolony.evolution.population import Subpopulation
from crcolony.evolution.reproduction import MatingOffer
from tests.support.mating_pairs import STREAM, agent, meet, subpopulation
from tests.support.scripted_randomness import ScriptedGenerator


def mutation(*steps: float) -> list[Any]:
    """Return what is drawn for a mutation of these steps."""
    return [[0.0 if step else 0.9 for step in steps], list(steps)]


NO_MUTATION = mutation(0.0, 0.0, 0.0)


def turn_over(own: Subpopulation, strategy: Pega, matings: int, script: list[Any]) -> list[float]:
    """Turn the only agent over; return its new genes."""
    generator = cast(Any, ScriptedGenerator(script))
    agents = strategy.next_agents(own, np.array([matings]), generator)
    own.replace_agents(agents, 1, 0)
    genes: list[float] = own.genotypes[0].tolist()
    return genes


def test_four_generations_go_as_in_the_table_worked_by_hand() -> None:
    """A first string, a worse one, the best one again, and a better one with a fitter partner."""
    own = subpopulation("a", [1, 2, 3], mutation=0.5)
    partner = subpopulation("b", [-1, -2, -3])
    strategy, other = Pega(), Pega()
    # 4 matings: the first string is the best; nobody fitter was met, so that it mutates
    assert turn_over(own, strategy, 4, mutation(0.0, 1.0, 0.0)) == [1, 3, 3]
    # 2 matings: no improvement, so that the best one is used again, as it is
    assert turn_over(own, strategy, 2, []) == [1, 2, 3]
    # 3 matings: so much is the best one worth now; it mutates
    assert turn_over(own, strategy, 3, mutation(0.0, 0.0, -1.0)) == [1, 2, 2]
    # 6 matings, which is better; the last partner had 9 when this one had 6: crossed, the second gene is the partner's
    meet((strategy, other), (agent(own, matings=6), agent(partner, matings=9)))
    assert turn_over(own, strategy, 6, [[0.9, 0.1, 0.9], *NO_MUTATION]) == [1, -2, 2]


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
    """The mother is the agent that had the string, however long ago; the father is the fitter partner."""
    own, partner = subpopulation("a", [1, 2, 3]), subpopulation("b", [-1, -2, -3])
    strategy = Pega()
    turn_over(own, strategy, 4, NO_MUTATION)
    own.genotypes[0] = [5, 5, 5]
    (again,) = strategy.next_agents(own, np.array([1]), cast(Any, ScriptedGenerator([])))
    assert (again.mother, again.father) == ("a/0", None)
    meet((strategy, Pega()), (agent(own, matings=5), agent(partner, matings=6)))
    rng = cast(Any, ScriptedGenerator([[0.9] * 3, *NO_MUTATION]))
    (newborn,) = strategy.next_agents(own, np.array([5]), rng)
    assert (newborn.mother, newborn.father) == ("a/1", "b/0")


def test_a_saved_strategy_remembers_the_best_strings() -> None:
    """And one that is restored goes on as the other would have."""
    own, strategy, restored = subpopulation("a", [1, 2, 3]), Pega(), Pega()
    turn_over(own, strategy, 4, NO_MUTATION)
    restored.restore(strategy.save())
    own.genotypes[0] = [5, 5, 5]
    assert turn_over(own, restored, 2, []) == [1, 2, 3]


def test_it_says_how_fit_it_is() -> None:
    """What nobody else of the colony does."""
    own = subpopulation("a", [1, 2, 3])
    offer = Pega().offer(agent(own, matings=3), STREAM)
    assert isinstance(offer, RatedOffer)
    assert offer.fitness == 3.0
    with pytest.raises(AssertionError):
        Pega().receive(agent(own), MatingOffer("b/0", own.genotypes[0]), STREAM)
