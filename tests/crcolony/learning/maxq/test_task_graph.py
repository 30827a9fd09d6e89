"""A task graph is ordered by what invokes what, and a wrong one is refused by name."""

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crcolony.learning.maxq.task_graph import (
    Composite,
    Primitive,
    QNode,
    Subtask,
    TaskGraph,
    TaskGraphError,
    children,
)
from tests.support.random_task_graphs import random_graph

STATES = 3
NOWHERE = np.zeros(STATES, dtype=np.bool_)
GO, STOP = Primitive("Go", 0), Primitive("Stop", 1)
WALK = Composite("Walk", (QNode(("Go",)),), NOWHERE)
ROOT = Composite("Root", (QNode(("Walk",)), QNode(("Stop",))), NOWHERE)


def invoking(name: str, *invoked: str) -> Composite:
    """Return a composite with these Q nodes."""
    return Composite(name, tuple(QNode((one,)) for one in invoked), NOWHERE)


@given(st.integers(0, 2**32))
def test_every_subtask_comes_after_those_that_it_invokes(seed: int) -> None:
    """The order has all subtasks once, primitives first, the root last."""
    graph = random_graph(np.random.default_rng(seed))
    order = list(graph.order)
    assert sorted(order) == sorted(one.name for one in graph.subtasks)
    kinds = [isinstance(graph[name], Primitive) for name in order]
    assert kinds == sorted(kinds, reverse=True)
    assert order[-1] == graph.root
    assert graph.descendants(graph.root) == set(order)
    for one in graph.subtasks:
        assert all(order.index(child) < order.index(one.name) for child in children(one))


@pytest.mark.parametrize(
    ("subtasks", "said"),
    [
        ((ROOT, WALK, GO, STOP, GO), "there are two subtasks Go"),
        ((ROOT, WALK, GO, Primitive("Stop", 0)), "Stop and Go are both action 0"),
        ((ROOT, WALK, GO, Primitive("Stop", -1)), "Stop: an action is not negative, got -1"),
        ((invoking("Root"), GO), "Root invokes nothing: a composite subtask needs a Q node"),
        ((invoking("Root", "go"), GO), "Root invokes go, which there is not"),
        ((invoking("Root", "Walking"), WALK, GO), "did you mean Walk?"),
        ((invoking("Root", "Go", "Go"), GO), "Root invokes Go twice"),
        ((ROOT, invoking("Walk", "Go", "Root"), GO, STOP), "a circle: Root → Walk → Root"),
        ((invoking("Root", "Go", "Root"), GO), "a circle: Root → Root"),
        ((WALK, invoking("Run", "Go"), GO), "has one root, not 2: Walk, Run"),
        ((WALK, GO, STOP), "has one root, not 2: Walk, Stop"),
        ((GO,), "Go is the root of a task graph, but no composite subtask"),
        ((), "a task graph needs a primitive subtask"),
        ((invoking("Root"),), "a task graph needs a primitive subtask"),
    ],
)
def test_a_graph_that_is_none_is_refused(subtasks: tuple[Subtask, ...], said: str) -> None:
    """Circles, several roots, unknown and doubled subtasks are named."""
    with pytest.raises(TaskGraphError) as refusal:
        TaskGraph(STATES, subtasks)
    assert said in str(refusal.value)
    assert "\n" not in str(refusal.value)


def change_walk(**changes: object) -> Callable[[], TaskGraph]:
    """Return how to make the graph with another Walk."""
    walk = dataclasses.replace(WALK, **changes)  # type: ignore[arg-type]
    return lambda: TaskGraph(STATES, (ROOT, walk, GO, STOP))


def change_q_node(**changes: object) -> Callable[[], TaskGraph]:
    """Return how to make the graph with another Q node of Walk."""
    return change_walk(q_nodes=(dataclasses.replace(QNode(("Go",)), **changes),))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (
            change_walk(terminal=np.zeros(2, dtype=np.bool_)),
            "Walk: its termination predicate has shape (2,), but",
        ),
        (
            change_walk(pseudo_reward=np.zeros(4)),
            "Walk: its pseudo-reward has shape (4,), but there are 3 states",
        ),
        (
            change_walk(pseudo_reward=np.full(3, np.nan)),
            "Walk: its pseudo-reward is not finite everywhere",
        ),
        (
            change_q_node(abstraction=np.zeros(3)),
            "Walk: the abstraction of its Q node Go needs whole numbers",
        ),
        (change_q_node(abstraction=np.array([0, -2, 0])), "is -2 in state 1, out of its range"),
        (
            change_q_node(parameter=np.array([0, 0, 1])),
            "Walk: the parameter of its Q node Go is 1 in state 2",
        ),
        (change_q_node(subtasks=()), "a Q node without a parameter invokes one subtask, not 0"),
        (
            change_q_node(subtasks=("Go", "Stop")),
            "a Q node without a parameter invokes one subtask, not 2",
        ),
        (
            change_walk(accepts=frozenset({"move"})),
            "Walk invokes Go, a primitive, but may only a move",
        ),
        (lambda: TaskGraph(0, (WALK, GO)), "a task graph needs a state, got 0"),
        (
            lambda: TaskGraph(STATES, (WALK, Primitive("Go", 0, np.array([0, -1, 0])))),
            "Go: its abstraction is -1 in state 1",
        ),
    ],
)
def test_what_does_not_fit_the_states_or_types_is_refused(
    make: Callable[[], TaskGraph], said: str
) -> None:
    """Arrays of a wrong shape or range, and children of a wrong type, are named with their subtask."""
    with pytest.raises(TaskGraphError) as refusal:
        make()
    assert said in str(refusal.value)


def test_children_of_the_right_type_are_accepted() -> None:
    """A strongly typed graph is one whose types fit."""
    walk = dataclasses.replace(WALK, accepts=frozenset({"move", "primitive"}))
    graph = TaskGraph(STATES, (ROOT, walk, GO, STOP))
    assert graph["Walk"] is walk
    with pytest.raises(TaskGraphError, match="no subtask Wolk; did you mean Walk"):
        graph["Wolk"]
