"""Strongly typed trees (Montana 1995; thesis 4.2): a grammar says which symbols may stand below which.

In Paper V a symbol is a subtask of MAXQ, and its type says whose child it may be. The children of a node are a set, as
the subtasks that a subtask can invoke are: no two of them have the same symbol.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

Path = tuple[int, ...]
"""Where a node is: the index of the child to take at each level; of the root it is ()."""


@dataclass(frozen=True, eq=False)
class Tree:
    """A node with all that is below it.

    It never changes, and is equal to itself alone: what crossover and mutation leave untouched of a parent is the
    same object in the offspring, which is how Lamarckian inheritance knows it.
    """

    symbol: str
    children: tuple["Tree", ...] = ()

    def __str__(self) -> str:
        """Return Root(A(b), c), with children in alphabetical order: trees that mean the same are written the same."""
        if not self.children:
            return self.symbol
        return f"{self.symbol}({', '.join(sorted(map(str, self.children)))})"

    @cached_property
    def height(self) -> int:
        """Levels from this node down to the lowest leaf, both counted."""
        return 1 + max((child.height for child in self.children), default=0)

    def walk(self, path: Path = ()) -> Iterator[tuple[Path, "Tree"]]:
        """Yield each node with its path, parents before children."""
        yield path, self
        for index, child in enumerate(self.children):
            yield from child.walk((*path, index))

    def at(self, path: Path) -> "Tree":
        """Return the node at a path. Raises IndexError if there is none."""
        return self if not path else self.children[path[0]].at(path[1:])

    def replaced(self, path: Path, node: "Tree") -> "Tree":
        """Return a tree with another node at a path: new down to there, and the same everywhere else."""
        if not path:
            return node
        children = list(self.children)
        children[path[0]] = children[path[0]].replaced(path[1:], node)
        return Tree(self.symbol, tuple(children))


@dataclass(frozen=True)
class Symbol:
    """A symbol of a type; one that accepts no type below it is a leaf, any other needs a child."""

    name: str
    type: str
    accepts: frozenset[str] = frozenset()
    """Types of the children that it may have"""


@dataclass(frozen=True)
class Grammar:
    """Which trees there are: their root, the symbols, and the most levels, the root's counted.

    Raises ValueError for names that are not unique or a root that is unknown or fits into no tree of this depth.
    """

    root: str
    symbols: tuple[Symbol, ...]
    max_depth: int

    def __post_init__(self) -> None:
        if len(self._by_name) < len(self.symbols):
            raise ValueError("two symbols have the same name")
        if self.root not in self._least_heights:
            raise ValueError(f"no tree of {self.max_depth} levels has the root {self.root}")

    def __getitem__(self, name: str) -> Symbol:
        """Return a symbol by its name. Raises KeyError if there is none."""
        return self._by_name[name]

    def accepts(self, parent: str, child: str) -> bool:
        """Return whether one symbol may be the parent of the other."""
        return self[child].type in self[parent].accepts

    def possible_children(self, parent: str, levels: int) -> list[str]:
        """Return the symbols that may be children of one and fit into so many levels, in the grammar's order."""
        return [
            one.name
            for one in self.symbols
            if self.accepts(parent, one.name)
            and self._least_heights.get(one.name, levels + 1) <= levels
        ]

    def is_well_typed(self, tree: Tree) -> bool:
        """Return whether a tree is one of this grammar: types, depth, leaves, and no two siblings alike."""
        return (
            tree.symbol == self.root
            and tree.height <= self.max_depth
            and all(self._is_node(node) for _, node in tree.walk())
        )

    def _is_node(self, node: Tree) -> bool:
        names = [child.symbol for child in node.children]
        return (
            bool(names) == bool(self[node.symbol].accepts)
            and len(set(names)) == len(names)
            and all(self.accepts(node.symbol, name) for name in names)
        )

    @cached_property
    def _by_name(self) -> dict[str, Symbol]:
        return {symbol.name: symbol for symbol in self.symbols}

    @cached_property
    def _least_heights(self) -> dict[str, int]:
        """Return the height of the lowest tree below each symbol, of those that have one within the depth."""
        least = {symbol.name: 1 for symbol in self.symbols if not symbol.accepts}
        for height in range(2, self.max_depth + 1):
            below = {self[name].type for name in least}
            least |= {
                symbol.name: height
                for symbol in self.symbols
                if symbol.name not in least and symbol.accepts & below
            }
        return least


def parse_tree(text: str) -> Tree:
    """Return the tree that `str` has written. Raises ValueError for text that no tree is written as."""
    tree, rest = _parse(text)
    if rest:
        raise ValueError(f"not a tree: {text}")
    return tree


def _parse(text: str) -> tuple[Tree, str]:
    """Return the tree at the begin of a text, and what follows it."""
    end = next((k for k, letter in enumerate(text) if letter in "(),"), len(text))
    symbol, rest = text[:end], text[end:]
    if not symbol.strip():
        raise ValueError(f"a symbol is missing before: {rest or 'the end'}")
    if not rest.startswith("("):
        return Tree(symbol), rest
    children: list[Tree] = []
    while not children or rest.startswith(", "):
        child, rest = _parse(rest.removeprefix(", ") if children else rest[1:])
        children.append(child)
    if not rest.startswith(")"):
        raise ValueError(f"a bracket of {symbol} does not close")
    return Tree(symbol, tuple(children)), rest[1:]
