"""Typed trees are what their grammar allows, and are written so that equal ones look equal."""

import pytest

from crcolony.evolution.typed_tree import Grammar, Symbol, Tree, parse_tree

GRAMMAR = Grammar(
    root="Root",
    symbols=(
        Symbol("Root", "root", frozenset({"part", "move"})),
        Symbol("Part", "part", frozenset({"part", "move"})),
        Symbol("Deep", "part", frozenset({"part"})),
        Symbol("left", "move"),
        Symbol("right", "move"),
    ),
    max_depth=4,
)


@pytest.mark.parametrize(
    ("text", "is_well_typed"),
    [
        ("Root(left)", True),
        ("Root(left, Part(Part(left), right))", True),
        ("Root(Part(left), Deep(Part(left)))", True),
        ("Part(left)", False),
        ("Root", False),
        ("Root(Part)", False),
        ("Root(left, left)", False),
        ("Root(left(right))", False),
        ("Root(Deep(left))", False),
        ("Root(Part(Root(left)))", False),
        ("Root(Part(Part(Part(left))))", False),
    ],
)
def test_a_grammar_says_which_trees_are_its_own(text: str, is_well_typed: bool) -> None:
    """By the root, types, leaves, siblings that differ, and depth."""
    assert GRAMMAR.is_well_typed(parse_tree(text)) is is_well_typed


def test_children_are_those_that_can_still_end_in_leaves() -> None:
    """Deep needs a part below it, and that a move."""
    assert GRAMMAR.possible_children("Root", 3) == ["Part", "Deep", "left", "right"]
    assert GRAMMAR.possible_children("Root", 2) == ["Part", "left", "right"]
    assert GRAMMAR.possible_children("Part", 1) == ["left", "right"]
    assert GRAMMAR.possible_children("Deep", 1) == []
    assert GRAMMAR.possible_children("left", 3) == []


def test_a_replaced_node_leaves_the_rest_the_same_objects() -> None:
    """Above it nodes are new; what stands beside it is shared, and the old tree is as it was."""
    tree = parse_tree("Root(left, Part(left, Part(right)))")
    new = Tree("right")
    other = tree.replaced((1, 0), new)
    assert str(other) == "Root(Part(Part(right), right), left)"
    assert str(tree) == "Root(Part(Part(right), left), left)"
    assert other.at((1, 0)) is new
    assert other.at((0,)) is tree.at((0,))
    assert other.at((1, 1)) is tree.at((1, 1))
    assert other.at((1,)) is not tree.at((1,))


def test_text_is_the_same_for_trees_that_mean_the_same_and_reads_back() -> None:
    """The order of children means nothing."""
    one, other = parse_tree("Root(right, Part(left))"), parse_tree("Root(Part(left), right)")
    assert str(one) == str(other) == str(parse_tree(str(one))) == "Root(Part(left), right)"
    assert one.height == 3


@pytest.mark.parametrize(
    "text", ["", "Root(", "Root(left", "Root()", "Root(left))", "Root(, left)"]
)
def test_text_that_is_no_tree_is_refused(text: str) -> None:
    """A symbol or a bracket is missing."""
    with pytest.raises(ValueError, match=r"not a tree|missing|does not close"):
        parse_tree(text)


def test_a_grammar_without_trees_is_refused() -> None:
    """Names that are not unique, a root that is unknown, one too deep."""
    symbols = (Symbol("A", "a", frozenset({"b"})), Symbol("B", "b"))
    assert Grammar("A", symbols, 2).root == "A"
    for root, given, depth in (
        ("A", symbols, 1),
        ("C", symbols, 2),
        ("A", (*symbols, *symbols), 2),
    ):
        with pytest.raises(ValueError, match=r"root|same name"):
            Grammar(root, given, depth)
