"""Agents weigh their partners by traits, which are handed down beside the genotype."""

import numpy as np
import pytest

from crcolony.evolution.reproduction import MatingOffer
from crcolony.experiments.colonies.mating_traits import (
    CHOOSINESS,
    DOUBT,
    LIE,
    NAMES,
    HealthOffer,
    TraitSelection,
    by_shown_health,
    by_threshold,
)
from crcolony.randomness import generator
from tests.support.mating_pairs import STREAM, agent, subpopulation


def traits_of(lie: float = 0.0, doubt: float = 0.0, choosiness: float = 0.0) -> np.ndarray:
    """Return the traits of an agent."""
    traits = np.zeros(len(NAMES))
    traits[[LIE, DOUBT, CHOOSINESS]] = lie, doubt, choosiness
    return traits


def offer_of(health: float, lie: float = 0.0) -> HealthOffer:
    """Return the offer of a partner."""
    return HealthOffer("b/0", np.array([-1.0, -2.0, -3.0]), traits_of(lie), health)


def strategy_of(*traits: np.ndarray, threshold: float | None = 0.0) -> TraitSelection:
    """Return a strategy that conceives by the own energy and by a threshold."""
    return TraitSelection(
        lambda energy: energy,
        lambda own, partner: by_threshold(own, partner, threshold=threshold),
        np.stack(traits),
    )


@pytest.mark.parametrize(
    ("health", "lie", "doubt", "seems"),
    [(0.4, 0.0, 0.0, 0.4), (0.4, 1.0, 0.0, 1.0), (0.4, 0.5, 0.0, 0.7), (0.4, 0.5, 1.0, 0.4)],
)
def test_a_lie_fills_up_the_energy_that_is_shown_and_doubt_sees_through_it(
    health: float, lie: float, doubt: float, seems: float
) -> None:
    """Wholly or in part; who is full has nothing to lie about."""
    own = traits_of(doubt=doubt)
    found = by_shown_health(own, offer_of(health, lie), lies=True, doubts=True)
    assert found == pytest.approx(seems)
    assert by_shown_health(own, offer_of(1.0, lie), lies=True, doubts=True) == pytest.approx(1.0)


def test_lies_and_doubt_count_only_where_they_are_allowed() -> None:
    """Elsewhere the traits are neutral."""
    own, partner = traits_of(doubt=1.0), offer_of(0.4, lie=1.0)
    assert by_shown_health(own, partner, lies=False, doubts=True) == pytest.approx(0.4)
    assert by_shown_health(own, partner, lies=True, doubts=False) == pytest.approx(1.0)


def test_the_choosy_take_partners_with_enough_energy() -> None:
    """As much as all are to ask for, or as the own trait does."""
    own = traits_of(choosiness=0.3)
    accepted = [by_threshold(own, offer_of(0.4), threshold=one) for one in (0.0, 0.5, None)]
    assert accepted == [1.0, 0.0, 1.0]
    assert by_threshold(traits_of(choosiness=0.5), offer_of(0.4), threshold=None) == 0.0


def test_an_agent_conceives_by_its_own_energy_and_by_the_partner() -> None:
    """Both must be; what is conceived has the genes and traits of both."""
    own, stream = subpopulation("a", [1, 2, 3]), STREAM.copy()
    mother = agent(own, energy=0.5)
    strategy = strategy_of(traits_of(lie=0.2, doubt=0.6), threshold=0.4)
    taken = [strategy.receive(mother, offer_of(0.4), stream) for _ in range(1000)]
    assert abs(np.mean([one is not None for one in taken]) - 0.5) < 0.05
    assert all(strategy.receive(mother, offer_of(0.3), stream) is None for _ in range(20))
    child = next(one for one in taken if one is not None)
    assert (child.mother, child.father) == ("a/0", "b/0")


def test_the_next_agents_have_the_traits_of_the_offspring_that_they_are() -> None:
    """Half from either parent; the traits of those that were not drawn are gone."""
    own, stream = subpopulation("a", [1, 2, 3], [1, 2, 3]), STREAM.copy()
    strategy = strategy_of(traits_of(lie=0.25), traits_of(lie=0.25))
    for _ in range(300):
        strategy.receive(agent(own, energy=1.0), offer_of(1.0, lie=0.75), stream)
    inherited = []
    for _ in range(100):
        agents = strategy.next_agents(own, np.array([0, 1]), generator(stream))
        assert [(one.mother, one.father) for one in agents] == [("a/0", "b/0")] * 2
        inherited.extend(strategy.traits[:, LIE].tolist())
    assert set(inherited) == {0.25, 0.75}
    assert np.mean(inherited) == pytest.approx(0.5, abs=0.1)


def test_without_offspring_agents_live_on_with_their_traits() -> None:
    """Mutated, as their genes are."""
    own = subpopulation("a", [1, 2, 3], mutation=1.0)
    strategy = strategy_of(traits_of(lie=0.5))
    (following,) = strategy.next_agents(own, np.array([0]), generator(STREAM.copy()))
    assert (following.mother, following.father) == ("a/0", None)
    assert strategy.traits.shape == (1, len(NAMES))
    assert 0.0 < abs(strategy.traits[0, LIE] - 0.5) < 0.5


def test_partners_reproduce_in_the_same_way_and_are_not_saved() -> None:
    """Anything else is a mistake in an experiment, and ends it."""
    own, strategy = subpopulation("a", [1, 2, 3]), strategy_of(traits_of())
    with pytest.raises(AssertionError, match="same way"):
        strategy.receive(agent(own), MatingOffer("b/0", np.zeros(3)), STREAM.copy())
    with pytest.raises(AssertionError, match="not saved"):
        strategy.save()
    with pytest.raises(AssertionError, match="not restored"):
        strategy.restore({})
