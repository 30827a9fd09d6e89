"""mEDEA: the next genome is a random one of those that were received, each once: a table worked by hand."""

from typing import Any, cast

import numpy as np

from crcolony.evolution.genotype import Gene, Schema
from crcolony.evolution.medea import Medea, bounced, equal_variance_sigma
from crcolony.evolution.population import Subpopulation
from tests.support.mating_pairs import agent, meet, subpopulation
from tests.support.scripted_randomness import ScriptedGenerator

MEDEA = Medea(0.5)


def genomes(own: Subpopulation) -> list[tuple[list[float], str]]:
    return [(kept.genes.tolist(), kept.father) for kept in own.pool]


def test_a_generation_goes_as_in_the_table_worked_by_hand() -> None:
    """Three meetings, two of them with the same agent, leave two genomes; then one is drawn for each."""
    a, b = subpopulation("a", [1, 2, 3], [4, 5, 6]), subpopulation("b", [-1, -2, -3], [7, 0, -7])
    for own, other, is_new in ((0, 0, True), (1, 0, False), (1, 1, True)):
        kept, _ = meet((MEDEA, MEDEA), (agent(a, own), agent(b, other)))
        assert (kept is not None) == is_new
    assert genomes(a) == [([-1, -2, -3], "b/0"), ([7, 0, -7], "b/1")]
    rng = ScriptedGenerator([[1, 0], [1.0, 0.0, -4.0], [0.0, 0.0, 0.2]])
    agents = MEDEA.next_agents(a, np.zeros(2, dtype=np.int64), cast(Any, rng))
    # 7 + 0.5 · 1, 0, and -7 - 0.5 · 4 = -9, which bounces off -8 to -7
    assert [one.genes.tolist() for one in agents] == [[7.5, 0.0, -7.0], [-1.0, -2.0, -2.9]]
    assert [(one.mother, one.father) for one in agents] == [("b/1", None), ("b/0", None)]


def test_energy_and_matings_play_no_part() -> None:
    """A genome of an agent that is nearly dead is as good as any."""
    a, b = subpopulation("a", [1, 2, 3]), subpopulation("b", [-1, -2, -3])
    pair = agent(a, energy=0.01, matings=0), agent(b, energy=0.01, matings=9)
    assert all(kept is not None for kept in meet((MEDEA, MEDEA), pair))


def test_what_was_received_is_a_copy() -> None:
    """The sender's genes may change."""
    a, b = subpopulation("a", [1, 2, 3]), subpopulation("b", [-1, -2, -3])
    meet((MEDEA, MEDEA), (agent(a), agent(b)))
    b.genotypes[0] = 0.0
    assert genomes(a) == [([-1, -2, -3], "b/0")]


def test_with_an_empty_reserve_the_present_agents_live_on_mutated() -> None:
    """Each is the parent of one."""
    a = subpopulation("a", [1, 2, 3], [4, 5, 6])
    rng = ScriptedGenerator([[0.0, 0.0, 2.0], [0.0, 0.0, 0.0]])
    agents = MEDEA.next_agents(a, np.zeros(2, dtype=np.int64), cast(Any, rng))
    assert [one.genes.tolist() for one in agents] == [[1, 2, 4], [4, 5, 6]]
    assert [(one.mother, one.father) for one in agents] == [("a/0", None), ("a/1", None)]


def test_genes_bounce_off_the_ends_of_their_ranges() -> None:
    """Where there are any; what goes far beyond one end stops at the other."""
    schema = Schema((Gene("bounded", 0.0, 1.0), Gene("free")))
    for genes, expected in (
        ([0.4, -50.0], [0.4, -50.0]),
        ([-0.25, 50.0], [0.25, 50.0]),
        ([1.25, 0.0], [0.75, 0.0]),
        ([7.0, 0.0], [0.0, 0.0]),
    ):
        assert bounced(np.array(genes), schema).tolist() == expected


def test_genes_move_as_far_as_those_of_the_colony_by_default() -> None:
    """Of equal variance: a tenth of the genes, or all of them by less."""
    assert np.isclose(equal_variance_sigma(0.1) ** 2, 0.1)
