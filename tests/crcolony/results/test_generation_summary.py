"""The row of a generation is the same from the arrays of a colony and from its events."""

import numpy as np
import pytest

from crcolony.evolution.history import Born, Event, Lived
from crcolony.results.generation_summary import (
    AgentColumns,
    genes_of,
    quantile_name,
    summarise,
    summarise_events,
)
from tests.support.small_colony import Recorder, live, new_colony


def lived() -> tuple[list[dict[str, float]], list[str], Recorder]:
    """Return the rows that a small colony makes of its generations, its genes, and its history."""
    colony, recorder = new_colony()
    colony.start()
    rows = []
    for generation in (1, 2, 3):
        live(colony, generation)
        rows.append(colony.summary)
    return rows, [gene.name for gene in colony.schema.genes], recorder


def test_arrays_and_events_make_the_same_rows() -> None:
    """But for the share of steps of the mating module, which no event holds."""
    rows, genes, recorder = lived()
    of_events = list(summarise_events(recorder.events, genes))
    assert len(of_events) == 3
    for row, other in zip(rows, of_events, strict=True):
        share = row.pop("mating_share")
        assert 0.0 <= share <= 1.0
        assert list(row) == list(other)
        assert other == pytest.approx(row, rel=1e-12)


def test_a_generation_that_a_robot_has_not_ended_has_no_row() -> None:
    """Nor have later ones."""
    _, genes, recorder = lived()
    missing: list[Event] = [
        event
        for event in recorder.events
        if not (isinstance(event, Lived) and (event.robot, event.generation) == (2, 1))
    ]
    (row,) = summarise_events(missing, genes)
    assert row["generation"] == 0
    assert list(summarise_events([], genes)) == []


def test_without_genotypes_a_row_has_no_genes() -> None:
    """The means are those of the columns."""
    agents = AgentColumns(
        matings=np.array([0, 1, 2, 5]),
        captures=np.array([1, 1, 1, 3]),
        energies=np.array([0.1, 0.2, 0.3, 0.4]),
        steps=np.array([10, 20, 30, 40]),
        has_starved=np.array([True, False, False, False]),
        conceptions_per_agent=0.75,
        genotypes=None,
    )
    assert summarise(3, 400, agents, []) == {
        "generation": 3,
        "tick": 400,
        "matings": 2.0,
        "captures": 1.5,
        "conceptions": 0.75,
        "energy": pytest.approx(0.25),
        "lived_steps": 25.0,
        "starved": 0.25,
    }


def test_the_genes_of_a_birth_are_those_of_the_agent() -> None:
    """And quantiles have names that sort."""
    genes = np.array([0.5, -1.0, 3.25])
    birth = Born(0, 0, 0, "0/0", "hash", genes.tobytes(), None, None)
    assert np.array_equal(genes_of(birth), genes)
    assert [quantile_name("mating.tau", share) for share in (0.05, 0.5)] == [
        "mating.tau q05",
        "mating.tau q50",
    ]
