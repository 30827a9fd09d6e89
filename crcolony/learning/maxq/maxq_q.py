"""MAXQ-Q, Algorithm 3.1, one call a step of the world and without recursion.

The recursion's call stack is an array, so that a world's compiled loop, or a robot, calls `learn_and_select`
as it calls any other learner. What is corrected, as in Dietterich (2000): eq. 3.13 is printed with V(a*, s_n)
where it is V(a*, s'). What is added to it, from his definition of execution: when a subtask's termination
predicate holds, all that it has invoked ends with it.
"""

from typing import NamedTuple

from crcolony.compiled import FloatArray, IntArray, compiled
from crcolony.learning.maxq.decomposition import Tables, inner_value, outer_value, project
from crcolony.learning.maxq.flat_graph import ACTIVE, FAILURE, FlatGraph
from crcolony.learning.maxq.task_graph import NO_ENTRY
from crcolony.learning.policies import NO_ACTION, softmax
from crcolony.randomness import Stream, draw

NODE = 0
"""Column of `stack`: a subtask that has been invoked and has not ended."""
EDGE = 1
"""Column of `stack`: the edge that it has selected."""
CHILD = 2
"""Column of `stack`: the subtask which that has invoked."""
START = 3
"""Column of `stack`: the step in which it did."""

DEPTH = 0
"""Element of `clock`: how many rows of `stack` are in use."""
TIME = 1
"""Element of `clock`: steps of this episode."""


class Learner(NamedTuple):
    """All arrays of one learner: n nodes; a composite has at most k edges."""

    graph: FlatGraph
    tables: Tables
    alpha: FloatArray
    """(n,) learning rate of each node"""
    temperature: FloatArray
    """(at most n,) tau of the softmax of composites"""
    temperature_entries: IntArray
    """(n,) which of these each node has: the values of a parameterised subtask have one together"""
    cooling: FloatArray
    """(n,) by which the temperature of a node is multiplied when it ends at a goal"""
    gamma: FloatArray
    """(1,)"""
    stack: IntArray
    """(longest path, 4) NODE, EDGE, CHILD, START; the root is the first row"""
    visited: IntArray
    """(memory,) the states s_n of the last steps, a ring: the childSeq of every row of `stack` ends with the last"""
    clock: IntArray
    """(2,) DEPTH, TIME"""
    choices: IntArray
    """(k,) edges that can be selected"""
    choice_values: FloatArray
    """(k,) and what they are worth"""
    scratch: FloatArray
    """(k,)"""


@compiled
def start_episode(learner: Learner, state: int, stream: Stream) -> int:
    """Start an episode, in place of one that may not have ended; return the first action.

    It is NO_ACTION where the root cannot begin.
    """
    root = learner.graph.first_edges.shape[0] - 2
    learner.clock[TIME] = 0
    learner.clock[DEPTH] = 0
    if learner.graph.ends[root, state] != ACTIVE:
        return NO_ACTION
    learner.stack[0, NODE] = root
    learner.clock[DEPTH] = 1
    return _invoke(learner, state, stream)


@compiled
def learn_and_select(
    learner: Learner, reward: float, state: int, terminal: bool, stream: Stream
) -> int:
    """Learn from the `reward` and next `state` that the last action led to; return the next action.

    After the end of the episode, or of the root, the next action is NO_ACTION.
    """
    graph, depth = learner.graph, learner.clock[DEPTH]
    _learn_reward(learner, reward)
    remaining = depth  # rows of the stack whose subtasks go on
    for row in range(depth - 1, -1, -1):
        if terminal or graph.ends[learner.stack[row, NODE], state] != ACTIVE:
            remaining = row
    for row in range(depth - 1, max(remaining - 1, 0) - 1, -1):
        _learn_completion(learner, row, state, terminal)
    for row in range(remaining, depth):
        _cool(learner, learner.stack[row, NODE], state, terminal)
    learner.clock[DEPTH] = remaining
    if remaining == 0:
        return NO_ACTION
    return _invoke(learner, state, stream)


@compiled
def _invoke(learner: Learner, state: int, stream: Stream) -> int:
    """Let the last subtask of the stack invoke another, and so on down to a primitive; return its action."""
    graph, stack = learner.graph, learner.stack
    learner.visited[learner.clock[TIME] % learner.visited.shape[0]] = state
    while True:
        row = learner.clock[DEPTH] - 1
        edge = _select_edge(learner, stack[row, NODE], state, stream)
        child = graph.targets[edge, state]
        stack[row, EDGE] = edge
        stack[row, CHILD] = child
        stack[row, START] = learner.clock[TIME]
        if child < graph.actions.shape[0]:
            learner.clock[TIME] += 1
            return int(graph.actions[child])
        stack[row + 1, NODE] = child
        learner.clock[DEPTH] += 1


@compiled
def _select_edge(learner: Learner, node: int, state: int, stream: Stream) -> int:
    """Select by softmax of C~(i, s, a) + V(a, s) among the edges whose subtasks can be invoked."""
    graph, tables = learner.graph, learner.tables
    project(graph, tables, node, state)
    count = 0
    for edge in range(graph.first_edges[node], graph.first_edges[node + 1]):
        if graph.ends[graph.targets[edge, state], state] == ACTIVE:
            learner.choices[count] = edge
            learner.choice_values[count] = inner_value(graph, tables, edge, state)
            count += 1
    choice = softmax(
        learner.choice_values[:count],
        learner.temperature[learner.temperature_entries[node]],
        learner.scratch[:count],
        draw(stream),
    )
    return int(learner.choices[choice])


@compiled
def _learn_reward(learner: Learner, reward: float) -> None:
    """Update V of the primitive that was executed (eq. 3.15)."""
    primitive = learner.stack[learner.clock[DEPTH] - 1, CHILD]
    state = learner.visited[(learner.clock[TIME] - 1) % learner.visited.shape[0]]
    values, entry = learner.tables.values, learner.graph.value_entries[primitive, state]
    values[entry] += learner.alpha[primitive] * (reward - values[entry])


@compiled
def _learn_completion(learner: Learner, row: int, state: int, terminal: bool) -> None:
    """Update C~ and C of what a row of the stack had invoked, in all states since (eq. 3.13, 3.14)."""
    graph, tables, now = learner.graph, learner.tables, learner.clock[TIME]
    node, edge, child = (
        learner.stack[row, NODE],
        learner.stack[row, EDGE],
        learner.stack[row, CHILD],
    )
    if terminal or graph.ends[node, state] != ACTIVE:
        inner, outer = graph.pseudo_rewards[node, state], 0.0
    else:
        project(graph, tables, node, state)
        best = tables.best_edges[node]
        inner = inner_value(graph, tables, best, state)
        outer = outer_value(graph, tables, best, state)
    alpha, memory = learner.alpha[node], learner.visited.shape[0]
    for time in range(now - 1, max(learner.stack[row, START], now - memory) - 1, -1):
        inner *= learner.gamma[0]
        outer *= learner.gamma[0]
        visited = learner.visited[time % memory]
        entry = graph.completion_entries[edge, visited]
        if entry == NO_ENTRY or graph.targets[edge, visited] != child:
            continue
        tables.inner_completions[entry] += alpha * (inner - tables.inner_completions[entry])
        tables.completions[entry] += alpha * (outer - tables.completions[entry])


@compiled
def _cool(learner: Learner, node: int, state: int, terminal: bool) -> None:
    """Lower the temperature of a subtask that has ended, unless in a failure or with another that has."""
    end = learner.graph.ends[node, state]
    if end == FAILURE or (end == ACTIVE and not terminal):
        return
    if learner.graph.pseudo_rewards[node, state] >= 0.0:
        learner.temperature[learner.temperature_entries[node]] *= learner.cooling[node]
