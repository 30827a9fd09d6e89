"""Trees become task graphs, and of two parents a child knows exactly what was learnt in untouched subtrees."""

import numpy as np
import pytest

from crcolony.compiled import FloatArray
from crcolony.evolution.tree_variation import Offspring, TreeVariation
from crcolony.evolution.typed_tree import Tree, parse_tree
from crcolony.experiments.hierarchy_graphs import (
    TaskGraphs,
    inherit_nothing,
    inherit_untouched,
    is_viable,
    primitives_of_situations,
    primitives_per_situation,
)
from crcolony.experiments.worlds.bring_home_tasks import GRAMMAR, bring_home_subtasks
from crcolony.learning.maxq.flat_graph import ACTIVE
from crcolony.learning.maxq.maxq_learner import MaxqQ, NodeParameters
from crcolony.learning.maxq.task_graph import TaskGraphError

SUBTASKS = bring_home_subtasks()
RICH = "Root(GetPack(FindPack(Wander), ReachPack(FollowLeft, ToPack)), BringHome(Rotate, ToNest), Wander)"


def learner_of(graphs: TaskGraphs, tree: Tree, rng: np.random.Generator) -> MaxqQ:
    """Return a learner that knows random numbers, each once."""
    learner = MaxqQ(graphs.graph_of(tree), default=NodeParameters(temperature=1.0))
    for table in learner.learner.tables[:3]:
        table[:] = rng.random(table.size)
    learner.learner.temperature[:] = rng.random(learner.learner.temperature.size)
    return learner


def known(learner: MaxqQ, name: str) -> list[FloatArray]:
    """Return all that is learnt of one subtask: V, C, C~ and temperature."""
    tables = learner.learner.tables[:3]
    node = learner.graph.order.index(name)
    values = [table[where] for table, where in zip(tables, learner._slices(node), strict=True)]
    return [*values, np.array([learner.temperature(name)])]


def same(one: MaxqQ, other: MaxqQ, name: str) -> bool:
    """Return whether two learners know the same of a subtask, bit for bit."""
    pairs = zip(known(one, name), known(other, name), strict=True)
    return all(np.array_equal(mine, theirs) for mine, theirs in pairs)


def test_a_tree_is_the_task_graph_that_it_says() -> None:
    """Subtasks invoke what stands below them, and are of their types."""
    graphs = TaskGraphs(GRAMMAR, SUBTASKS)
    tree = parse_tree(RICH)
    graph = graphs.graph_of(tree)
    assert graph.root == graphs.name_of(tree)
    pack = tree.children[0]
    assert graph.descendants(graphs.name_of(pack)) == {
        *(graphs.name_of(node) for node in (pack, *pack.children)),
        *("Wander", "FollowLeft", "ToPack"),
    }
    assert graph[graphs.name_of(pack)].type == "pack"


def test_a_node_is_the_same_subtask_in_every_tree_and_at_two_places_one() -> None:
    """Another node of the same symbol is another subtask."""
    graphs = TaskGraphs(GRAMMAR, SUBTASKS)
    shared, other = parse_tree("FindPack(Wander)"), parse_tree("FindPack(Wander)")
    twice = Tree("Root", (shared, Tree("GetPack", (shared,))))
    names = graphs.graph_of(twice).order
    assert names.count(graphs.name_of(shared)) == 1
    assert len([name for name in names if name.startswith("FindPack")]) == 1
    once = graphs.graph_of(Tree("Root", (shared,)))
    assert once[graphs.name_of(shared)] is graphs.graph_of(twice)[graphs.name_of(shared)]
    assert graphs.name_of(other) != graphs.name_of(shared)


def test_a_tree_that_is_not_well_typed_is_refused() -> None:
    """By the task graph, which knows the types, or because a leaf is no primitive."""
    graphs = TaskGraphs(GRAMMAR, SUBTASKS)
    with pytest.raises(TaskGraphError, match="FindPack 1 invokes ToPack"):
        graphs.graph_of(Tree("FindPack", (Tree("ToPack"),)))
    with pytest.raises(TaskGraphError, match="FindNest is a leaf"):
        graphs.graph_of(Tree("Root", (Tree("FindNest"),)))


@pytest.mark.parametrize("seed", range(12))
def test_lamarckian_inheritance_keeps_exactly_the_untouched_subtrees(seed: int) -> None:
    """Donated ones as the second parent has learnt them, others as the first; what is new knows nothing."""
    rng = np.random.default_rng(seed)
    graphs, variation = TaskGraphs(GRAMMAR, SUBTASKS), TreeVariation(GRAMMAR, 1.0, 0.5, 0.7)
    grandparent = variation.founder(rng)
    # Relatives, so that the two have subtasks in common and have learnt different things in them.
    first, second = (
        variation.offspring(grandparent, variation.founder(rng), rng).tree for _ in range(2)
    )
    offspring = variation.offspring(first, second, rng)
    parents = learner_of(graphs, first, rng), learner_of(graphs, second, rng)
    child = MaxqQ(graphs.graph_of(offspring.tree), initial_value=-7.0)
    inherit_untouched(graphs, child, offspring, *parents)
    of_first = {node for _, node in first.walk() if node.children}
    donated = {node for _, node in offspring.donated.walk()} if offspring.donated else set()
    for _, node in offspring.tree.walk():
        if not node.children:
            continue
        name = graphs.name_of(node)
        if node in donated:
            assert same(child, parents[1], name)
        elif node in of_first:
            assert same(child, parents[0], name)
        else:
            assert all((values == -7.0).all() for values in known(child, name)[1:3])


def test_darwinian_inheritance_discards_all() -> None:
    """Even of an offspring that is its parent again, which by Lamarck would know all."""
    graphs, rng = TaskGraphs(GRAMMAR, SUBTASKS), np.random.default_rng(0)
    tree = parse_tree(RICH)
    parent = learner_of(graphs, tree, rng)
    child = MaxqQ(parent.graph, initial_value=-7.0)
    inherit_nothing(graphs, child, Offspring(tree), parent, parent)
    assert all((table == -7.0).all() for table in child.learner.tables[:3])
    inherit_untouched(graphs, child, Offspring(tree), parent, parent)
    for own, theirs in zip(child.learner.tables[:3], parent.learner.tables[:3], strict=True):
        np.testing.assert_array_equal(own, theirs)


def test_primitives_are_counted_in_each_type_of_situation() -> None:
    """A subtask that has ended there offers nothing."""
    tree = parse_tree(RICH)
    assert primitives_of_situations(tree, SUBTASKS) == [
        {"Wander"},
        {"Wander", "FollowLeft", "ToPack"},
        {"Wander", "Rotate", "ToNest"},
        {"Wander", "Rotate", "ToNest"},
    ]
    assert primitives_per_situation(tree, SUBTASKS) == 10 / 4
    assert is_viable(tree, SUBTASKS)
    blind = parse_tree("Root(BringHome(ToNest), ReachPack(ToPack))")
    assert primitives_per_situation(blind, SUBTASKS) == 3 / 4
    assert not is_viable(blind, SUBTASKS)


def test_what_can_be_executed_depends_on_the_type_of_the_situation_alone() -> None:
    """So one state stands for all of its type."""
    for kind in SUBTASKS.composites.values():
        for situation in range(4):
            assert len(set(kind.terminal[SUBTASKS.situations == situation])) == 1
    assert ACTIVE == 0
