"""The decomposition of projected values, equations 3.9 to 3.12: V of primitives, C and C~ of Q nodes.

Of the two completion functions C~ counts pseudo-rewards, and decides what a subtask does; C does not,
and is what the subtask is worth to those that invoke it.
"""

from typing import NamedTuple

from crcolony.compiled import FloatArray, IntArray, compiled
from crcolony.learning.maxq.flat_graph import ACTIVE, FlatGraph
from crcolony.learning.maxq.task_graph import NO_ENTRY
from crcolony.learning.policies import NO_ACTION

NO_EDGE = -1
"""The best edge of a subtask that has ended."""


class Tables(NamedTuple):
    """What is learnt, and the projected values that were computed of it last."""

    values: FloatArray
    """V of the primitives, see `TableSizes`"""
    completions: FloatArray
    """C of the edges, see `TableSizes`"""
    inner_completions: FloatArray
    """C~, as C"""
    node_values: FloatArray
    """(n,) V(i, s)"""
    best_edges: IntArray
    """(n,) the recursively greedy a* of each composite in s, or NO_EDGE"""


@compiled
def completion(graph: FlatGraph, table: FloatArray, edge: int, state: int) -> float:
    """Return C(i, s, a), or C~ where that is the `table`."""
    entry = graph.completion_entries[edge, state]
    if entry == NO_ENTRY:
        return 0.0
    return float(table[entry])


@compiled
def project(graph: FlatGraph, tables: Tables, node: int, state: int) -> None:
    """Compute V(j, s) and a* of a node and all its descendants j (eq. 3.9 and 3.10).

    a* maximises C~(j, s, a) + V(a, s), the first of equals. The value of a subtask that has ended is 0.
    """
    primitives = graph.actions.shape[0]
    for position in range(graph.first_descendants[node], graph.first_descendants[node + 1]):
        one = graph.descendants[position]
        if one < primitives:
            tables.node_values[one] = tables.values[graph.value_entries[one, state]]
            continue
        best, best_value = NO_EDGE, 0.0
        if graph.ends[one, state] == ACTIVE:
            for edge in range(graph.first_edges[one], graph.first_edges[one + 1]):
                child = graph.targets[edge, state]
                if graph.ends[child, state] == ACTIVE:
                    value = inner_value(graph, tables, edge, state)
                    if best == NO_EDGE or value > best_value:
                        best, best_value = edge, value
        tables.best_edges[one] = best
        tables.node_values[one] = (
            0.0 if best == NO_EDGE else outer_value(graph, tables, best, state)
        )


@compiled
def inner_value(graph: FlatGraph, tables: Tables, edge: int, state: int) -> float:
    """Return C~(i, s, a) + V(a, s), by the V that `project` has computed."""
    value = float(tables.node_values[graph.targets[edge, state]])
    return value + completion(graph, tables.inner_completions, edge, state)


@compiled
def outer_value(graph: FlatGraph, tables: Tables, edge: int, state: int) -> float:
    """Return Q(i, s, a) = V(a, s) + C(i, s, a) (eq. 3.10), by the V that `project` has computed."""
    value = float(tables.node_values[graph.targets[edge, state]])
    return value + completion(graph, tables.completions, edge, state)


@compiled
def greedy_action(graph: FlatGraph, tables: Tables, state: int) -> int:
    """Return the action at the end of the greedy path from the root; NO_ACTION if the root has ended.

    A world that is driven by this alone is driven without commitment: the hierarchy only ranks actions
    (Dietterich's hierarchical greedy execution, which is at least as good as the learnt policy).
    """
    node = graph.first_edges.shape[0] - 2
    project(graph, tables, node, state)
    while node >= graph.actions.shape[0]:
        if tables.best_edges[node] == NO_EDGE:
            return NO_ACTION
        node = graph.targets[tables.best_edges[node], state]
    return int(graph.actions[node])
