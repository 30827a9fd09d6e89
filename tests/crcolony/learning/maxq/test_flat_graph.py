"""The arrays of a graph say what the graph says."""

from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from crcolony.learning.maxq.flat_graph import ACTIVE, FAILURE, GOAL, flatten, longest_path
from crcolony.learning.maxq.task_graph import (
    NO_ENTRY,
    Composite,
    Primitive,
    QNode,
    TaskGraph,
    children,
)
from tests.support.random_task_graphs import STATES, random_graph


@given(st.integers(0, 2**32))
def test_entries_of_different_tables_are_different(seed: int) -> None:
    """All entries together are 0, 1, ... total - 1, each of one primitive or edge."""
    graph = random_graph(np.random.default_rng(seed))
    flat, sizes = flatten(graph)
    for entries, firsts in [
        (flat.value_entries, sizes.first_values),
        (flat.completion_entries, sizes.first_completions),
    ]:
        for row, (first, end) in zip(entries, pairwise(firsts), strict=True):
            stored = row[row != NO_ENTRY]
            assert np.all((stored >= first) & (stored < end))
    assert sizes.total == sizes.first_values[-1] + sizes.first_completions[-1]


@given(st.integers(0, 2**32))
def test_edges_lead_to_what_q_nodes_name(seed: int) -> None:
    """In every state an edge invokes a child of its node, which comes before it; no path is longer than the longest."""
    graph = random_graph(np.random.default_rng(seed))
    flat, _ = flatten(graph)
    for node, name in enumerate(graph.order):
        edges = slice(flat.first_edges[node], flat.first_edges[node + 1])
        invoked = {graph.order[child] for child in np.unique(flat.targets[edges])}
        assert invoked <= set(children(graph[name]))
        assert np.all(flat.targets[edges] < node)
        found = flat.descendants[flat.first_descendants[node] : flat.first_descendants[node + 1]]
        assert {graph.order[one] for one in found} == graph.descendants(name)
        assert found.tolist() == sorted(found)
    composites = sum(isinstance(one, Composite) for one in graph.subtasks)
    assert 1 <= longest_path(flat) <= composites


def test_a_subtask_without_anything_to_invoke_has_failed() -> None:
    """Where all its children have ended it ends too; where its pseudo-reward is negative it has failed, else not."""
    walk = Composite(
        "Walk", (QNode(("Go",)),), np.array([False, True, True]), np.array([0.0, 0.0, -1.0])
    )
    root = Composite("Root", (QNode(("Walk",)),), np.zeros(3, dtype=np.bool_))
    flat, _ = flatten(TaskGraph(3, (root, walk, Primitive("Go", 0))))
    assert flat.ends.tolist() == [
        [ACTIVE, ACTIVE, ACTIVE],
        [ACTIVE, GOAL, FAILURE],
        [ACTIVE, FAILURE, FAILURE],
    ]


def test_a_q_node_that_is_always_worth_nothing_has_no_entries() -> None:
    """A completion function that is 0 everywhere is not stored."""
    nothing = np.full(STATES, NO_ENTRY)
    root = Composite(
        "Root", (QNode(("Go",), abstraction=nothing),), np.zeros(STATES, dtype=np.bool_)
    )
    _, sizes = flatten(
        TaskGraph(STATES, (root, Primitive("Go", 0, np.zeros(STATES, dtype=np.int64))))
    )
    assert sizes.total == 1
