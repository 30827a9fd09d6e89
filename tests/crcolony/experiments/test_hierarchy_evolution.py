"""Hierarchies evolve: the same seed the same way, and towards those that bring packs home."""

import math

import numpy as np

from crcolony.evolution.tree_variation import TreeVariation
from crcolony.experiments.hierarchy_evolution import Evolved, Settings, drift, evolve
from crcolony.experiments.hierarchy_graphs import (
    Inherit,
    TaskGraphs,
    inherit_nothing,
    inherit_untouched,
)
from crcolony.experiments.worlds.bring_home import new_world
from crcolony.experiments.worlds.bring_home_tasks import GRAMMAR, bring_home_subtasks
from crcolony.randomness import new_streams

WORLD = new_world(12.0, (6.0, 3.0), (2.0, 7.0, 10.0, 11.0), (40.0, math.pi))
SETTINGS = Settings(TreeVariation(GRAMMAR), individuals=10, life_steps=300)


def run(seed: int, inherit: Inherit, generations: int = 12) -> Evolved:
    """Evolve in the easy world."""
    graphs = TaskGraphs(GRAMMAR, bring_home_subtasks())
    return evolve(SETTINGS, graphs, [WORLD] * generations, inherit, new_streams(seed, (1,), 1)[0])


def test_hierarchies_evolve_and_a_seed_gives_one_history() -> None:
    """All trees stay well typed, and more packs come home than at first."""
    one, again = run(1, inherit_untouched), run(1, inherit_untouched)
    np.testing.assert_array_equal(one.mean_fitness, again.mean_fitness)
    assert [str(tree) for tree in one.trees] == [str(tree) for tree in again.trees]
    assert all(GRAMMAR.is_well_typed(tree) for tree in one.trees)
    assert one.mean_fitness[-3:].mean() > 2.0 * one.mean_fitness[0]
    assert one.best_fitness[-1] == one.fitness.max()


def test_inheritances_begin_with_the_same_founders_in_the_same_world() -> None:
    """Runs of a seed can be compared in pairs: their first generations are one."""
    lamarckian, darwinian = run(2, inherit_untouched, 3), run(2, inherit_nothing, 3)
    assert lamarckian.mean_fitness[0] == darwinian.mean_fitness[0]
    assert lamarckian.mean_fitness[-1] != darwinian.mean_fitness[-1]


def test_drift_selects_what_is_viable() -> None:
    """Of trees that wander none but they have offspring, where there are any: soon all do."""

    def share_that_wanders(generations: int) -> float:
        stream = new_streams(3, (1,), 1)[0]
        trees = drift(SETTINGS, generations, lambda tree: "Wander" in str(tree), stream)
        assert len(trees) == SETTINGS.individuals
        assert all(GRAMMAR.is_well_typed(tree) for tree in trees)
        return sum("Wander" in str(tree) for tree in trees) / len(trees)

    assert share_that_wanders(1) < share_that_wanders(12) >= 0.8
