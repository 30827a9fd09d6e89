"""The row of a generation is the same from the arrays of a colony and from its events."""

import numpy as np
import pytest

from crcolony.compiled import FloatArray, IntArray
from crcolony.evolution.history import Born, Event, Lived, Mated
from crcolony.learning.policies import hyperbolic_decay
from crcolony.results.generation_summary import (
    AgentColumns,
    genes_of,
    quantile_name,
    summarise,
    summarise_events,
)
from crcolony.robot.genes import META_PARAMETERS
from crcolony.robot.modules import MODULES
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
    """But for what comes from the steps of each module, which no event holds."""
    rows, genes, recorder = lived()
    of_events = list(summarise_events(recorder.events, genes))
    assert len(of_events) == 3
    for row, other in zip(rows, of_events, strict=True):
        assert 0.0 <= row["mating_share"] <= 1.0
        known = {
            name: value
            for name, value in row.items()
            if name != "mating_share" and "effective_tau" not in name
        }
        assert list(known) == list(other)
        assert other == pytest.approx(known, rel=1e-12)
    assert sum(row["energy_weighted_matings"] for row in rows) > 0.0


def test_energy_weighted_matings_are_the_conceptions_to_expect() -> None:
    """Of two matings at energies 0.25 and 0.5 and one at 1.0: 0.75 for one agent, 1.0 for its partner."""
    genes = np.zeros(10).tobytes()
    names = [f"{module.name}.{meta}" for module in MODULES for meta in META_PARAMETERS]
    events: list[Event] = [
        Born(0, robot, 0, f"{robot}/0", "hash", genes, None, None) for robot in (0, 1)
    ]
    events += [
        Mated(5, 0, 1, "0/0", "1/0", 0.25, 0.0, False, False),
        Mated(9, 0, 1, "0/0", "1/0", 0.5, 1.0, True, True),
    ]
    events += [Lived(20, robot, 0, f"{robot}/0", 10, 0.4, 0, 2) for robot in (0, 1)]
    (row,) = summarise_events(events, names)
    assert row["energy_weighted_matings"] == (0.75 + 1.0) / 2
    assert (row["matings"], row["conceptions"]) == (2.0, 1.0)


def test_the_effective_tau_is_that_of_the_last_step_of_a_lifetime() -> None:
    """As the learner computes it, for every agent; a module that is never selected keeps its tau."""
    names = [f"{module.name}.{meta}" for module in MODULES for meta in META_PARAMETERS]
    genotypes = np.random.default_rng(3).random((2, 3, len(names)))
    steps = np.array([[[0, 7], [50, 1], [900, 0]], [[3, 3], [0, 1200], [8, 40]]])
    row = summarise(0, 0, columns(genotypes=genotypes, module_steps=steps), names)
    for m, module in enumerate(MODULES):
        taus = [
            hyperbolic_decay(
                genotypes[index][names.index(f"{module.name}.tau")],
                genotypes[index][names.index(f"{module.name}.tau_decay")],
                steps[index][m],
            )
            for index in np.ndindex(2, 3)
        ]
        name = f"{module.name}.effective_tau"
        assert row[f"{name} mean"] == pytest.approx(np.mean(taus))
        assert row[quantile_name(name, 0.5)] == pytest.approx(np.median(taus))
    assert row["mating_share"] == steps[..., 1].sum() / steps.sum()


def columns(
    genotypes: FloatArray | None = None, module_steps: IntArray | None = None
) -> AgentColumns:
    """Return four agents, as if nothing but these columns mattered."""
    return AgentColumns(
        matings=np.array([0, 1, 2, 5]),
        energy_weighted_matings=np.array([0.0, 0.5, 1.0, 2.5]),
        captures=np.array([1, 1, 1, 3]),
        energies=np.array([0.1, 0.2, 0.3, 0.4]),
        steps=np.array([10, 20, 30, 40]),
        has_starved=np.array([True, False, False, False]),
        conceptions_per_agent=0.75,
        genotypes=genotypes,
        module_steps=module_steps,
    )


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
    assert summarise(3, 400, columns(), []) == {
        "generation": 3,
        "tick": 400,
        "matings": 2.0,
        "captures": 1.5,
        "conceptions": 0.75,
        "energy_weighted_matings": 1.0,
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
