"""PGTA transfers single genes from those with much energy to those with little: a table worked by hand."""

from typing import Any

import numpy as np
import pytest

from crcolony.evolution import pgta
from crcolony.evolution.pgta import Pgta, accept_probability, one_gene, overwrite, send_probability
from crcolony.randomness import generator
from tests.support.mating_pairs import STREAM, agent, meet, subpopulation
from tests.support.scripted_randomness import ScriptedGenerator

TABLE = [
    # energies, draws (a sends? b sends? a accepts? b accepts?), locus and mutation of what is sent, genes after it
    ((0.9, 0.2), (0.5, 0.5, 0.5, 0.5), [(1, 0.0)], [1, 2, 3], [-1, 2, -3]),  # a sends, b accepts
    (
        (0.9, 0.2),
        (0.5, 0.5, 0.5, 0.9),
        [(1, 0.0)],
        [1, 2, 3],
        [-1, -2, -3],
    ),  # b is not so receptive
    ((0.9, 0.2), (0.95, 0.5, 0.5, 0.5), [], [1, 2, 3], [-1, -2, -3]),  # nobody sends
    (
        (0.5, 0.5),
        (0.4, 0.4, 0.4, 0.4),
        [(0, 0.0), (2, 0.0)],
        [1, 2, -3],
        [1, -2, -3],
    ),  # both do both
    (
        (0.9, 0.2),
        (0.5, 0.5, 0.5, 0.5),
        [(2, 1.5)],
        [1, 2, 3],
        [-1, -2, 4.5],
    ),  # a gene mutates on the way
    ((1.0, 0.0), (0.99, 0.0, 0.0, 0.99), [(0, 0.0)], [1, 2, 3], [1, -2, -3]),  # certain, both of it
]


@pytest.mark.parametrize(("energies", "draws", "sent", "first", "second"), TABLE)
def test_genes_move_as_in_the_table_worked_by_hand(
    energies: tuple[float, float],
    draws: tuple[float, ...],
    sent: list[tuple[int, float]],
    first: list[float],
    second: list[float],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Whoever draws below its energy sends; whoever draws below what is missing of it to 1 accepts."""
    a, b = subpopulation("a", [1, 2, 3]), subpopulation("b", [-1, -2, -3])
    numbers: list[Any] = []
    for locus, mutation in sent:
        numbers += [[0.0 if mutation else 0.9] * 3, [mutation] * 3, locus]
    script, uniform = ScriptedGenerator(numbers), iter(draws)
    monkeypatch.setattr(pgta, "draw_uncompiled", lambda stream: next(uniform))
    both = Pgta(0.1)
    monkeypatch.setattr(both, "_events", script)
    meet((both, both), (agent(a, energy=energies[0]), agent(b, energy=energies[1])))
    assert a.genotypes[0].tolist() == first
    assert b.genotypes[0].tolist() == second
    assert script.is_used_up()
    assert list(uniform) == []


def test_the_two_probabilities_add_up_to_one() -> None:
    """Sending rises with the energy, accepting falls."""
    for energy in (0.0, 0.25, 1.0):
        assert send_probability(energy) == energy
        assert send_probability(energy) + accept_probability(energy) == 1.0


def test_a_broadcast_is_one_gene() -> None:
    """The others are NaN, and overwrite nothing; a broadcast of none neither."""
    genes = np.array([1.0, 2.0, 3.0])
    sent = one_gene(np.array([7.0, 8.0, 9.0]), 1)
    assert np.isnan(sent).tolist() == [True, False, True]
    assert overwrite(genes, sent)
    assert genes.tolist() == [1.0, 8.0, 3.0]
    assert not overwrite(genes, np.full(3, np.nan))
    assert genes.tolist() == [1.0, 8.0, 3.0]


def test_agents_live_on_with_the_genes_that_they_have_then() -> None:
    """A birth after the turnover names who it was before, and the last donor, if there was one."""
    a, b = subpopulation("a", [1, 2, 3], [4, 5, 6]), subpopulation("b", [-1, -2, -3])
    both = Pgta(0.0)
    changed, _ = meet((both, both), (agent(a, energy=0.0), agent(b, energy=1.0)))
    assert changed is not None
    assert a.pool == [changed]
    one, other = both.next_agents(a, np.array([1, 0]), generator(STREAM.copy()))
    assert one.genes.tolist() == a.genotypes[0].tolist() != [1, 2, 3]
    assert (one.mother, one.father) == ("a/0", "b/0")
    assert other.genes.tolist() == [4, 5, 6]
    assert (other.mother, other.father) == ("a/1", None)
