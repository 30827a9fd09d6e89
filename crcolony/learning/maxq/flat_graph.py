"""A task graph as arrays, for compiled code: nodes, Q nodes ("edges") and states are numbers.

Nodes have the order of `TaskGraph.order`: primitives first, and every subtask after those that it
invokes. So the values of a subtask and of all below it (eq. 3.9 to 3.11) are one pass over its
descendants, without recursion. The arrays are read only, and learners of one graph share them.
"""

from typing import NamedTuple

import numpy as np

from crcolony.compiled import FloatArray, IntArray, RowArray
from crcolony.learning.maxq.task_graph import NO_ENTRY, Composite, Primitive, QNode, TaskGraph

ACTIVE = 0
"""In `ends`: the subtask can be invoked, and goes on."""
GOAL = 1
"""In `ends`: it ends, at a goal."""
FAILURE = 2
"""In `ends`: it ends elsewhere, with a negative pseudo-reward or because it can invoke nothing."""


class FlatGraph(NamedTuple):
    """A task graph of n nodes, of which p are primitives, with q edges (Q nodes)."""

    first_edges: IntArray
    """(n + 1,) the edges of node i are first_edges[i] ... first_edges[i + 1] - 1"""
    first_descendants: IntArray
    """(n + 1,) the same for `descendants`"""
    descendants: IntArray
    """of every node, itself the last, each after those that it invokes"""
    actions: IntArray
    """(p,) the action of each primitive"""
    value_entries: RowArray
    """(p, states) index of V(i, s)"""
    targets: RowArray
    """(q, states) the node that an edge invokes"""
    completion_entries: RowArray
    """(q, states) index of C(i, s, a) and of C~(i, s, a), or NO_ENTRY where both are 0"""
    ends: RowArray
    """(n, states) ACTIVE, GOAL or FAILURE"""
    pseudo_rewards: FloatArray
    """(n, states) R~_i(s')"""


class TableSizes(NamedTuple):
    """Where the entries of each node and edge are: those of one are next to each other."""

    first_values: IntArray
    """(p + 1,) the entries V of primitive i are first_values[i] ... first_values[i + 1] - 1"""
    first_completions: IntArray
    """(q + 1,) the same for the entries C of each edge"""

    @property
    def total(self) -> int:
        """The numbers that are stored: V and C, as Dietterich counts them."""
        return int(self.first_values[-1] + self.first_completions[-1])


def flatten(graph: TaskGraph) -> tuple[FlatGraph, TableSizes]:
    """Return the arrays of a graph, and the sizes of its tables.

    A composite that has no subtask to invoke in a state ends there, as a failure: an unfortunate
    graph is a bad one and not an endless loop.
    """
    names = graph.order
    numbers = {name: number for number, name in enumerate(names)}
    subtasks = [graph[name] for name in names]
    primitives = [one for one in subtasks if isinstance(one, Primitive)]
    composites = [one for one in subtasks if isinstance(one, Composite)]
    q_nodes = [node for one in composites for node in one.q_nodes]
    edge_counts = [0] * len(primitives) + [len(one.q_nodes) for one in composites]
    targets = np.array([_targets(node, numbers, graph.states) for node in q_nodes], dtype=np.int32)
    first_edges = _running_sum(edge_counts)
    descendants = [sorted(numbers[one] for one in graph.descendants(name)) for name in names]
    value_entries, first_values = _entries([one.abstraction for one in primitives], graph.states)
    completions, first_completions = _entries([one.abstraction for one in q_nodes], graph.states)
    pseudo_rewards = np.zeros((len(names), graph.states))
    for one in composites:
        if one.pseudo_reward is not None:
            pseudo_rewards[numbers[one.name]] = one.pseudo_reward
    flat = FlatGraph(
        first_edges=first_edges,
        first_descendants=_running_sum([len(one) for one in descendants]),
        descendants=np.concatenate(descendants).astype(np.int64),
        actions=np.array([one.action for one in primitives], dtype=np.int64),
        value_entries=value_entries,
        targets=targets,
        completion_entries=completions,
        ends=_ends(composites, len(primitives), first_edges, targets, pseudo_rewards),
        pseudo_rewards=pseudo_rewards,
    )
    return flat, TableSizes(first_values, first_completions)


def longest_path(flat: FlatGraph) -> int:
    """Return the composites on the longest path from the root to a primitive: the stack's depth."""
    nodes = flat.first_edges.size - 1
    depths = np.zeros(nodes, dtype=np.int64)
    for node in range(flat.actions.size, nodes):
        edges = slice(flat.first_edges[node], flat.first_edges[node + 1])
        depths[node] = 1 + depths[flat.targets[edges]].max()
    return int(depths[-1])


def _targets(node: QNode, numbers: dict[str, int], states: int) -> IntArray:
    invoked = np.array([numbers[name] for name in node.subtasks], dtype=np.int64)
    parameter = np.zeros(states, dtype=np.int64) if node.parameter is None else node.parameter
    return np.asarray(invoked[parameter])


def _entries(abstractions: list[IntArray | None], states: int) -> tuple[RowArray, IntArray]:
    """Return indices (tables, states) into one table after the other, and where each begins."""
    rows = np.empty((len(abstractions), states), dtype=np.int32)
    sizes = []
    for row, abstraction in zip(rows, abstractions, strict=True):
        row[:] = np.arange(states) if abstraction is None else abstraction
        sizes.append(int(row.max()) + 1)
    firsts = _running_sum(sizes)
    rows += np.where(rows == NO_ENTRY, 0, firsts[:-1, None]).astype(np.int32)
    return rows, firsts


def _ends(
    composites: list[Composite],
    primitives: int,
    first_edges: IntArray,
    targets: RowArray,
    pseudo_rewards: FloatArray,
) -> RowArray:
    """Return ACTIVE, GOAL or FAILURE of every node in every state."""
    states = pseudo_rewards.shape[1]
    ends = np.full(pseudo_rewards.shape, ACTIVE, dtype=np.int8)
    for node, one in enumerate(composites, start=primitives):
        can_invoke = np.zeros(states, dtype=np.bool_)
        for edge in range(first_edges[node], first_edges[node + 1]):
            can_invoke |= ends[targets[edge], np.arange(states)] == ACTIVE
        ends[node, ~can_invoke] = FAILURE
        goals = one.terminal & (pseudo_rewards[node] >= 0.0)
        ends[node, one.terminal] = FAILURE
        ends[node, goals] = GOAL
    return ends


def _running_sum(counts: list[int]) -> IntArray:
    return np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
