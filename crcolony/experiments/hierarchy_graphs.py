"""Typed trees as task graphs of MAXQ (Paper V), and what offspring inherit of what was learnt in them.

A node of a tree is a subtask: the same node, in whatever tree, the same subtask. So a subtree that crossover has moved
is the subtask that its parent has learnt, and one that stands at two places is one subtask which two others invoke.
"""

from collections.abc import Callable
from weakref import WeakKeyDictionary

from crcolony.compiled import IntArray
from crcolony.evolution.tree_variation import Offspring
from crcolony.evolution.typed_tree import Grammar, Tree
from crcolony.experiments.worlds.bring_home_tasks import Subtasks
from crcolony.learning.maxq.maxq_learner import MaxqQ
from crcolony.learning.maxq.task_graph import Composite, Primitive, QNode, TaskGraph, TaskGraphError


class TaskGraphs:
    """Makes task graphs of trees that are well typed by a grammar whose leaves are the primitive subtasks."""

    def __init__(self, grammar: Grammar, subtasks: Subtasks) -> None:
        self._grammar = grammar
        self._subtasks = subtasks
        self._composites: WeakKeyDictionary[Tree, Composite] = WeakKeyDictionary()
        self._made = 0

    def graph_of(self, tree: Tree) -> TaskGraph:
        """Return the task graph of a tree. Raises TaskGraphError for one that is not well typed."""
        used: dict[str, Primitive | Composite] = {}
        for _, node in tree.walk():
            if not node.children and node.symbol not in self._subtasks.primitives:
                raise TaskGraphError(f"{node.symbol} is a leaf of the tree, but no primitive")
            used[self.name_of(node)] = (
                self._composite(node) if node.children else self._subtasks.primitives[node.symbol]
            )
        return TaskGraph(self._subtasks.states, tuple(used.values()))

    def name_of(self, node: Tree) -> str:
        """Return the name that a node's subtask has in every task graph."""
        return self._composite(node).name if node.children else node.symbol

    def _composite(self, node: Tree) -> Composite:
        if node not in self._composites:
            kind, symbol = self._subtasks.composites[node.symbol], self._grammar[node.symbol]
            q_nodes = tuple(
                QNode((self.name_of(child),), abstraction=kind.abstraction)
                for child in node.children
            )
            self._made += 1
            self._composites[node] = Composite(
                name=f"{node.symbol} {self._made}",
                q_nodes=q_nodes,
                terminal=kind.terminal,
                pseudo_reward=kind.pseudo_reward,
                type=symbol.type,
                accepts=symbol.accepts,
            )
        return self._composites[node]


Inherit = Callable[[TaskGraphs, MaxqQ, Offspring, MaxqQ, MaxqQ], None]
"""Gives a newborn learner, of an offspring of a first and a second parent, what it knows at birth."""


def inherit_nothing(
    _graphs: TaskGraphs, _child: MaxqQ, _offspring: Offspring, _first: MaxqQ, _second: MaxqQ
) -> None:
    """Darwinian inheritance: what the parents have learnt is lost."""


def inherit_untouched(
    graphs: TaskGraphs, child: MaxqQ, offspring: Offspring, first: MaxqQ, second: MaxqQ
) -> None:
    """Lamarckian inheritance (Paper V): subtasks of untouched subtrees keep what their parent has learnt.

    Those of the donated subtree keep the second parent's values, all others that are not new the first one's.
    """
    known = set(first.graph.order)
    for _, node in offspring.tree.walk():
        if node.children and graphs.name_of(node) in known:
            child.inherit(first, graphs.name_of(node))
    donated = offspring.donated
    if donated is not None:
        present = set(child.graph.order)
        for _, node in donated.walk():
            if node.children and graphs.name_of(node) in present:
                child.inherit(second, graphs.name_of(node))


INHERITANCES: dict[str, Inherit] = {
    "Darwinian": inherit_nothing,
    "Lamarckian": inherit_untouched,
}


def primitives_of_situations(tree: Tree, subtasks: Subtasks) -> list[frozenset[str]]:
    """Return the symbols of the primitive subtasks that can be executed in each type of situation.

    They are those below which nothing has ended: what ends depends on the type of the situation alone.
    """
    situations: IntArray = subtasks.situations
    states = [int((situations == one).argmax()) for one in range(int(situations.max()) + 1)]
    return [_executable(tree, subtasks, state) for state in states]


def is_viable(tree: Tree, subtasks: Subtasks) -> bool:
    """Return whether a robot has something to do in all types of situations."""
    return all(primitives_of_situations(tree, subtasks))


def primitives_per_situation(tree: Tree, subtasks: Subtasks) -> float:
    """Return how many primitive subtasks can be executed in a type of situations, on average over the types."""
    counts = [len(one) for one in primitives_of_situations(tree, subtasks)]
    return sum(counts) / len(counts)


def _executable(node: Tree, subtasks: Subtasks, state: int) -> frozenset[str]:
    """Return the symbols of the primitives that a subtask can come to execute in a state."""
    if not node.children:
        return frozenset((node.symbol,))
    if subtasks.composites[node.symbol].terminal[state]:
        return frozenset()
    return frozenset().union(*(_executable(child, subtasks, state) for child in node.children))
