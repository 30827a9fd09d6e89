"""Evolution of hierarchies (Paper V): genetic programming makes task graphs, and robots learn in them by MAXQ-Q.

What an individual is worth is how many packs it brings home in its life, in which it learns.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.evolution.selection import tournament
from crcolony.evolution.tree_variation import Offspring, TreeVariation
from crcolony.evolution.typed_tree import Tree
from crcolony.experiments.hierarchy_graphs import Inherit, TaskGraphs
from crcolony.experiments.worlds.bring_home import World
from crcolony.experiments.worlds.bring_home_life import live
from crcolony.learning.maxq.maxq_learner import MaxqQ, NodeParameters
from crcolony.randomness import Stream, generator

_PARAMETERS = NodeParameters(alpha=0.5, temperature=0.1, cooling=0.95)


@dataclass(frozen=True)
class Settings:
    """All numbers of an evolutionary run, and of the learning in it: ours, found by trying."""

    variation: TreeVariation
    individuals: int = 24
    tournament: int = 3
    life_steps: int = 2000
    patience_steps: int = 200
    """After which a trip is broken off"""
    gamma: float = 0.97
    parameters: NodeParameters = _PARAMETERS
    memory_steps: int = 256


@dataclass(frozen=True, eq=False)
class Evolved:
    """A run, and its last generation."""

    mean_fitness: FloatArray
    """(generations,) packs brought home in a life, mean over all individuals"""
    best_fitness: FloatArray
    """(generations,)"""
    trees: Sequence[Tree]
    """(individuals,) of the last generation"""
    fitness: FloatArray
    """(individuals,) of the last generation"""


def evolve(
    settings: Settings,
    graphs: TaskGraphs,
    worlds: Sequence[World],
    inherit: Inherit,
    stream: Stream,
) -> Evolved:
    """Evolve one generation in each of the worlds, one after the other."""
    rng = generator(stream)
    trees = [settings.variation.founder(rng) for _ in range(settings.individuals)]
    learners = [_newborn(settings, graphs, tree) for tree in trees]
    history = np.empty((len(worlds), settings.individuals))
    for generation, world in enumerate(worlds):
        if generation > 0:
            offspring, parents = _offspring(settings, trees, history[generation - 1], rng)
            newborns = [_newborn(settings, graphs, one.tree) for one in offspring]
            for child, one, (first, second) in zip(newborns, offspring, parents, strict=True):
                inherit(graphs, child, one, learners[first], learners[second])
            trees, learners = [one.tree for one in offspring], newborns
        history[generation] = [_live(settings, learner, world, stream) for learner in learners]
    return Evolved(history.mean(axis=1), history.max(axis=1), trees, history[-1])


def drift(
    settings: Settings, generations: int, is_viable: Callable[[Tree], bool], stream: Stream
) -> Sequence[Tree]:
    """Return the trees of the last generation where all that are viable have the same prospects, and others less.

    So variation alone makes of trees what they are.
    """
    rng = generator(stream)
    trees = [settings.variation.founder(rng) for _ in range(settings.individuals)]
    for _ in range(generations - 1):
        viable = np.array([is_viable(tree) for tree in trees], dtype=np.float64)
        offspring, _ = _offspring(settings, trees, viable, rng)
        trees = [one.tree for one in offspring]
    return trees


def _offspring(
    settings: Settings, trees: Sequence[Tree], fitness: FloatArray, rng: np.random.Generator
) -> tuple[list[Offspring], list[tuple[int, int]]]:
    """Return a new generation, and the parents of each."""
    # Random numbers decide between equals, who would else be selected by their index.
    ranks = np.lexsort((rng.random(fitness.size), fitness)).argsort().astype(np.float64)
    chosen = tournament(ranks, 2 * len(trees), settings.tournament, rng)
    parents = [(int(first), int(second)) for first, second in chosen.reshape(-1, 2)]
    vary = settings.variation.offspring
    return [vary(trees[first], trees[second], rng) for first, second in parents], parents


def _newborn(settings: Settings, graphs: TaskGraphs, tree: Tree) -> MaxqQ:
    return MaxqQ(
        graphs.graph_of(tree),
        settings.gamma,
        default=settings.parameters,
        memory=settings.memory_steps,
    )


def _live(settings: Settings, learner: MaxqQ, world: World, stream: Stream) -> int:
    return live(
        learner.learner,
        world,
        np.zeros(6),
        settings.life_steps,
        settings.patience_steps,
        np.zeros(1, dtype=np.int64),
        stream,
    )
