"""The face of MAXQ-Q refuses what is wrong, and hands values on by the names of subtasks."""

import dataclasses

import numpy as np
import pytest

from crcolony.learning.maxq.maxq_learner import MaxqQ, NodeParameters
from crcolony.learning.maxq.task_graph import (
    Composite,
    Primitive,
    QNode,
    TaskGraph,
    TaskGraphError,
)
from crcolony.randomness import new_streams

NOWHERE = np.zeros(3, dtype=np.bool_)
GO, STOP = Primitive("Go", 0), Primitive("Stop", 1)
WALK = Composite("Walk", (QNode(("Go",)), QNode(("Stop",))), NOWHERE)


def graph_of(*others: str, walk: Composite = WALK) -> TaskGraph:
    """Return a graph whose root may walk, or what else is named."""
    q_nodes = tuple(QNode((name,)) for name in ("Walk", *others))
    return TaskGraph(3, (Composite("Root", q_nodes, NOWHERE), walk, GO, STOP))


@pytest.mark.parametrize(
    ("alpha", "temperature", "cooling"),
    [(-0.1, 0.0, 1.0), (1.1, 0.0, 1.0), (0.5, -1.0, 1.0), (0.5, 0.0, 1.1), (0.5, np.nan, 1.0)],
)
def test_meta_parameters_out_of_range_are_refused(
    alpha: float, temperature: float, cooling: float
) -> None:
    """Each of them is."""
    with pytest.raises(ValueError):
        NodeParameters(alpha, temperature, cooling)


def test_a_learner_that_cannot_be_is_refused() -> None:
    """A gamma above 1, no memory, and meta-parameters of a subtask that there is not."""
    with pytest.raises(ValueError):
        MaxqQ(graph_of(), gamma=1.1)
    with pytest.raises(ValueError):
        MaxqQ(graph_of(), memory=0)
    with pytest.raises(TaskGraphError, match="no subtask Wolk; did you mean Walk"):
        MaxqQ(graph_of(), parameters={"Wolk": NodeParameters()})


def test_calls_that_make_no_sense_are_refused() -> None:
    """A state that there is not, and a step before an episode has started."""
    learner, stream = MaxqQ(graph_of()), new_streams(1, (1,), 1)[0]
    for state in (-1, 3):
        with pytest.raises(ValueError, match=r"a state is in 0 \.\.\. 2"):
            learner.start(state, stream)
    with pytest.raises(ValueError, match="no episode has started"):
        learner.step(0.0, 0, False, stream)
    learner.start(0, stream)
    learner.step(0.0, 0, False, stream)
    assert learner.steps == 2


def test_every_subtask_has_its_own_meta_parameters() -> None:
    """Those that are not named have the default."""
    given = {"Walk": NodeParameters(0.1, 2.0, 0.5)}
    learner = MaxqQ(graph_of(), parameters=given, default=NodeParameters(0.9, 1.0, 0.7))
    names = learner.graph.order
    assert dict(zip(names, learner.learner.alpha, strict=True))["Walk"] == 0.1
    assert learner.temperature("Root") == 1.0
    assert dict(zip(names, learner.learner.cooling, strict=True))["Go"] == 0.7


def test_the_values_of_a_parameterised_subtask_share_a_temperature() -> None:
    """It falls whichever of them ends, and is no other subtask's."""
    ends = np.array([False, True, True])
    values = [
        Composite(name, (QNode(("Go",)),), ends, parameterised="Walk")
        for name in ("Walk(1)", "Walk(2)")
    ]
    root = Composite("Root", (QNode(("Walk(1)", "Walk(2)"), np.array([0, 1, 0])),), NOWHERE)
    learner = MaxqQ(TaskGraph(3, (root, *values, GO)), default=NodeParameters(0.5, 8.0, 0.5))
    stream = new_streams(1, (1,), 1)[0]
    learner.start(0, stream)
    learner.step(0.0, 1, False, stream)
    assert [learner.temperature(one.name) for one in values] == [4.0, 4.0]
    assert learner.temperature("Root") == 8.0  # it has ended where it can invoke nothing: no goal
    learner.start(0, stream)
    learner.step(0.0, 1, True, stream)
    assert learner.temperature("Walk(2)") == 2.0


def test_a_subtree_is_inherited_and_nothing_else() -> None:
    """Walk, Go and Stop are taken over, in a graph where they have other places; the root keeps its own."""
    one, other = MaxqQ(graph_of(), initial_value=1.0), MaxqQ(graph_of("Stop"), initial_value=2.0)
    other.learner.temperature[:] = 5.0
    for table in other.learner.tables[:3]:
        table[:] = np.arange(table.size)
    one.inherit(other, "Walk")
    for state in range(3):
        assert one.value(state, "Walk") == other.value(state, "Walk")
        assert one.value(state, "Go") == other.value(state, "Go")
    assert one.value(0) == one.value(0, "Walk") + 1.0
    assert [one.temperature(name) for name in one.graph.order] == [5.0, 5.0, 5.0, 0.0]


def test_a_subtree_that_differs_is_not_inherited() -> None:
    """Where a subtask below is another one, what was learnt does not hold."""
    changed = graph_of(walk=dataclasses.replace(WALK, terminal=~NOWHERE & [False, False, True]))
    with pytest.raises(TaskGraphError, match="Walk differs in the two task graphs, at Walk"):
        MaxqQ(graph_of()).inherit(MaxqQ(changed), "Walk")


def test_the_entries_of_all_subtasks_are_all_that_is_stored() -> None:
    """Two primitives, two edges and one, each with a value in every state."""
    learner = MaxqQ(graph_of())
    entries = {name: learner.entries(name) for name in learner.graph.order}
    assert entries == {"Go": 3, "Stop": 3, "Walk": 6, "Root": 3}
    assert sum(entries.values()) == learner.sizes.total
