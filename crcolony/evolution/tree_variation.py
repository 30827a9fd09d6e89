"""How typed trees begin and vary: growth, subtree crossover and mutation (thesis 4.2, strongly typed as in Paper V).

Offspring share with their parents, as the same objects, all subtrees that were not touched. What is above a place
that was touched is new.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from crcolony.evolution.typed_tree import Grammar, Path, Tree


@dataclass(frozen=True, eq=False)
class Offspring:
    """A tree that was made of a first parent's, and what of it came from the second."""

    tree: Tree
    donated: Tree | None = None
    """The subtree of the second parent; None: all is of the first, or new"""


@dataclass(frozen=True)
class TreeVariation:
    """How likely trees are crossed, mutate, and go on growing. Raises ValueError for what is no probability."""

    grammar: Grammar
    crossover_probability: float = 0.6
    mutation_probability: float = 0.2
    growth_probability: float = 0.5
    """Of one child more, after the first"""

    def __post_init__(self) -> None:
        for probability in (
            self.crossover_probability,
            self.mutation_probability,
            self.growth_probability,
        ):
            if not 0.0 <= probability <= 1.0:
                raise ValueError(f"not a probability: {probability}")

    def founder(self, rng: np.random.Generator) -> Tree:
        """Return a tree that has grown at random."""
        return self._grow(self.grammar.root, self.grammar.max_depth, rng)

    def offspring(self, first: Tree, second: Tree, rng: np.random.Generator) -> Offspring:
        """Return the first tree, perhaps with a subtree of the second's, perhaps mutated."""
        child = Offspring(first)
        if rng.random() < self.crossover_probability:
            child = self.crossover(first, second, rng)
        if rng.random() < self.mutation_probability:
            child = Offspring(self.mutant(child.tree, rng), child.donated)
        return child

    def crossover(self, first: Tree, second: Tree, rng: np.random.Generator) -> Offspring:
        """Put a subtree of the second tree in the place of one of the first: all places and subtrees that fit alike.

        Where none fits the offspring is the first tree itself.
        """
        nodes = [node for path, node in second.walk() if path]
        paths = [path for path, _ in first.walk() if path]
        for index in rng.permutation(len(paths)):
            path = paths[index]
            fitting = [node for node in nodes if self._fits(first, path, node)]
            if fitting:
                donated = fitting[int(rng.integers(len(fitting)))]
                return Offspring(first.replaced(path, donated), donated)
        return Offspring(first)

    def mutant(self, tree: Tree, rng: np.random.Generator) -> Tree:
        """Return a tree in which a subtree has been replaced, added or removed, one as likely as the other.

        Where that is not possible it is the same tree.
        """
        operators: tuple[Callable[[Tree, np.random.Generator], Tree], ...] = (
            self._replace,
            self._add,
            self._remove,
        )
        return operators[int(rng.integers(len(operators)))](tree, rng)

    def _grow(self, symbol: str, levels: int, rng: np.random.Generator) -> Tree:
        possible = self.grammar.possible_children(symbol, levels - 1)
        if not possible:
            return Tree(symbol)
        count = 1
        while count < len(possible) and rng.random() < self.growth_probability:
            count += 1
        chosen = sorted(rng.permutation(len(possible))[:count].tolist())
        return Tree(symbol, tuple(self._grow(possible[k], levels - 1, rng) for k in chosen))

    def _fits(self, tree: Tree, path: Path, node: Tree) -> bool:
        """Return whether another node may stand at a path: its type, its height, and what its siblings are."""
        parent, own = tree.at(path[:-1]), tree.at(path)
        return (
            node is not own
            and self.grammar.accepts(parent.symbol, node.symbol)
            and len(path) + node.height <= self.grammar.max_depth
            and all(one.symbol != node.symbol for one in parent.children if one is not own)
        )

    def _replace(self, tree: Tree, rng: np.random.Generator) -> Tree:
        paths = [path for path, _ in tree.walk() if path]
        path = paths[int(rng.integers(len(paths)))]
        siblings = {
            one.symbol for k, one in enumerate(tree.at(path[:-1]).children) if k != path[-1]
        }
        return tree.replaced(path, self._grow_below(tree.at(path[:-1]), path[:-1], siblings, rng))

    def _add(self, tree: Tree, rng: np.random.Generator) -> Tree:
        places = [
            (path, node)
            for path, node in tree.walk()
            if len(self._possible(node, path)) > len(node.children)
        ]
        if not places:
            return tree
        path, node = places[int(rng.integers(len(places)))]
        new = self._grow_below(node, path, {child.symbol for child in node.children}, rng)
        return tree.replaced(path, Tree(node.symbol, (*node.children, new)))

    def _remove(self, tree: Tree, rng: np.random.Generator) -> Tree:
        paths = [path for path, _ in tree.walk() if path and len(tree.at(path[:-1]).children) > 1]
        if not paths:
            return tree
        path = paths[int(rng.integers(len(paths)))]
        parent = tree.at(path[:-1])
        left = tuple(child for k, child in enumerate(parent.children) if k != path[-1])
        return tree.replaced(path[:-1], Tree(parent.symbol, left))

    def _grow_below(
        self, parent: Tree, path: Path, siblings: set[str], rng: np.random.Generator
    ) -> Tree:
        """Return a new child of the node at a path, unlike its siblings: there is at least one that is possible."""
        possible = [name for name in self._possible(parent, path) if name not in siblings]
        name = possible[int(rng.integers(len(possible)))]
        return self._grow(name, self.grammar.max_depth - len(path) - 1, rng)

    def _possible(self, parent: Tree, path: Path) -> list[str]:
        return self.grammar.possible_children(parent.symbol, self.grammar.max_depth - len(path) - 1)
