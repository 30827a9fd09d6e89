"""Trees vary within their types, and share with their parents what was not touched."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from crcolony.evolution.tree_variation import TreeVariation
from crcolony.evolution.typed_tree import Grammar, Symbol, Tree, parse_tree

TYPES = ("a", "b", "c")


@st.composite
def grammars(draw: st.DrawFn) -> Grammar:
    """Draw a grammar that has trees: any types may stand below any, in circles too."""
    composites = [
        Symbol(
            f"N{k}",
            draw(st.sampled_from(TYPES)),
            frozenset(draw(st.sets(st.sampled_from(TYPES), min_size=1))),
        )
        for k in range(draw(st.integers(1, 4)))
    ]
    leaves = [Symbol(f"l{k}", draw(st.sampled_from(TYPES))) for k in range(draw(st.integers(1, 4)))]
    root = Symbol(
        "Root", "root", frozenset({leaves[0].type, *draw(st.sets(st.sampled_from(TYPES)))})
    )
    return Grammar("Root", (root, *composites, *leaves), draw(st.integers(2, 6)))


def nodes_of(tree: Tree) -> set[Tree]:
    """Return all nodes, which are equal to themselves alone."""
    return {node for _, node in tree.walk()}


@settings(max_examples=60, deadline=None)
@given(grammar=grammars(), seed=st.integers(0, 2**32 - 1))
def test_growth_crossover_and_mutation_keep_types_and_depth(grammar: Grammar, seed: int) -> None:
    """Over some generations, in any grammar; and of the parents nothing changes."""
    rng = np.random.default_rng(seed)
    variation = TreeVariation(grammar, 0.8, 0.8, 0.6)
    trees = [variation.founder(rng) for _ in range(4)]
    for _ in range(8):
        before = [str(tree) for tree in trees]
        first, second = (trees[int(k)] for k in rng.integers(4, size=2))
        child = variation.offspring(first, second, rng).tree
        assert [str(tree) for tree in trees] == before
        assert grammar.is_well_typed(child), str(child)
        trees[int(rng.integers(4))] = child


@settings(max_examples=40, deadline=None)
@given(grammar=grammars(), seed=st.integers(0, 2**32 - 1))
def test_crossover_makes_new_only_what_is_above_the_donated_subtree(
    grammar: Grammar, seed: int
) -> None:
    """Every other node is a parent's own: those of the donated subtree the second one's."""
    rng = np.random.default_rng(seed)
    variation = TreeVariation(grammar, growth_probability=0.7)
    first, second = variation.founder(rng), variation.founder(rng)
    child = variation.crossover(first, second, rng)
    if child.donated is None:
        assert child.tree is first
        return
    place = next(path for path, node in child.tree.walk() if node is child.donated)
    new = {child.tree.at(place[:depth]) for depth in range(len(place))}
    assert nodes_of(child.donated) <= nodes_of(second)
    assert not new & (nodes_of(first) | nodes_of(second))
    assert nodes_of(child.tree) - new - nodes_of(child.donated) <= nodes_of(first)


def test_the_same_generator_gives_the_same_trees() -> None:
    """Nothing else is drawn from."""
    grammar = Grammar(
        "Root",
        (Symbol("Root", "r", frozenset("am")), Symbol("A", "a", frozenset("m")), Symbol("x", "m")),
        3,
    )
    variation = TreeVariation(grammar)

    def history(seed: int) -> list[str]:
        rng = np.random.default_rng(seed)
        trees = [variation.founder(rng), variation.founder(rng)]
        for _ in range(30):
            trees.append(variation.offspring(trees[-1], trees[-2], rng).tree)
        return [str(tree) for tree in trees]

    assert history(1) == history(1)
    assert history(1) != history(2)


def test_a_crossover_that_fits_nowhere_leaves_the_first_parent_as_it_is() -> None:
    """The second has only what would stand beside its like, or what may not stand there."""
    grammar = Grammar(
        "Root",
        (
            Symbol("Root", "r", frozenset("mn")),
            Symbol("N", "n", frozenset("o")),
            Symbol("x", "m"),
            Symbol("y", "m"),
            Symbol("z", "o"),
        ),
        3,
    )
    variation = TreeVariation(grammar)
    first, second = parse_tree("Root(N(z))"), parse_tree("Root(x)")
    offspring = [variation.crossover(first, second, np.random.default_rng(k)) for k in range(20)]
    # x fits in the place of N, and z stays: a node of type o is below N alone.
    assert {str(one.tree) for one in offspring} == {"Root(x)"}
    both = parse_tree("Root(x, y)")
    swapped = {
        str(variation.crossover(both, second, np.random.default_rng(k)).tree) for k in range(20)
    }
    assert swapped == {"Root(x, y)"}  # x in the place of its like, never beside it


def test_mutation_replaces_adds_and_removes() -> None:
    """All three happen, and the last child of a subtask is never removed."""
    grammar = Grammar(
        "Root", (Symbol("Root", "r", frozenset("m")), *(Symbol(n, "m") for n in "xyz")), 2
    )
    variation = TreeVariation(grammar)
    rng = np.random.default_rng(0)
    pair, single, full = (parse_tree(text) for text in ("Root(x, y)", "Root(x)", "Root(x, y, z)"))
    found = {str(variation.mutant(pair, rng)) for _ in range(60)}
    assert {"Root(x, y, z)", "Root(x)", "Root(y)", "Root(y, z)", "Root(x, z)"} <= found
    assert all(variation.mutant(single, rng).children for _ in range(30))
    assert {len(variation.mutant(full, rng).children) for _ in range(30)} == {2, 3}


def test_what_is_no_probability_is_refused() -> None:
    """Of crossover, mutation or growth."""
    grammar = Grammar("Root", (Symbol("Root", "r", frozenset("m")), Symbol("x", "m")), 2)
    for wrong in ((1.5, 0.1, 0.1), (0.1, -0.1, 0.1), (0.1, 0.1, 2.0)):
        with pytest.raises(ValueError, match="not a probability"):
            TreeVariation(grammar, *wrong)
