"""Evolution of hierarchies (Paper V, thesis 5.5): find a pack and bring it to the nest, by MAXQ graphs that evolve.

Three environments are of rising difficulty: in the first one primitive subtask is enough for each aim, in the second a
robot has to search, and in the third a wall is in the way, so that it has to mix primitives. In a fourth nothing but
the wall is difficult, and lives are long enough to learn how to get around it in one. Then there are four ways
in which the environment can change from generation to generation, the 2 x 2 of arXiv 2605.15769. Runs of one seed begin
with the same founders, whatever is inherited, and are compared in pairs.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import product

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.evolution.tree_variation import TreeVariation
from crcolony.evolution.typed_tree import Tree
from crcolony.experiments.framework.experiment import Column, Experiment, Job, Plan, Row
from crcolony.experiments.hierarchies_claims import (
    CHANGES,
    DARWINIAN,
    DRIFT,
    EDGE,
    ENVIRONMENTS,
    IN_SIGHT,
    LAMARCKIAN,
    LONG_LIVED,
    LONG_LIVES,
    MEASURES,
    OUT_OF_SIGHT,
    SENSES,
    WALL_IN_VIEW,
    WALLED,
    condition_of,
)
from crcolony.experiments.hierarchies_figure import draw
from crcolony.experiments.hierarchy_evolution import Settings, drift, evolve
from crcolony.experiments.hierarchy_graphs import (
    TaskGraphs,
    inherit_nothing,
    inherit_untouched,
    is_viable,
    primitives_per_situation,
)
from crcolony.experiments.worlds.bring_home import World, new_world
from crcolony.experiments.worlds.bring_home_tasks import GRAMMAR, Subtasks, bring_home_subtasks
from crcolony.randomness import new_streams

GENERATIONS = 30
LONG_LIFE_STEPS = 6000
END = 10
"""Generations at the end over which columns are means"""
_QUICK_GENERATIONS = 3
_QUICK = Settings(TreeVariation(GRAMMAR), individuals=6, life_steps=200)
_INHERIT = {DARWINIAN: inherit_nothing, LAMARCKIAN: inherit_untouched}
_ALL_AROUND = math.pi
_SIZE, _NEST, _PACKS = 14.0, (7.0, 2.5), (3.0, 10.0, 11.0, 13.0)
_NEAR, _FAR = (8.0, _ALL_AROUND), (30.0, _ALL_AROUND)
"""Range and angle of the camera"""
_OPEN_AT_THE_RIGHT = ((0.0, 7.0, 10.0, 7.0),)
_OPEN_AT_THE_LEFT = ((4.0, 7.0, 14.0, 7.0),)

EDGES = tuple(
    f"{EDGE}{parent.name} {child.name}"
    for parent, child in product(GRAMMAR.symbols, GRAMMAR.symbols)
    if GRAMMAR.accepts(parent.name, child.name)
)
_AT_END = "last generation"

COLUMNS = {
    "generation": Column("generation, at a point of a curve", "generations"),
    "mean_fitness": Column("packs brought home in a life, mean over individuals", "packs"),
    "fitness_end": Column(f"the same, mean of the last {END} generations", "packs"),
    "fitness_late": Column("the same, mean of the second half of all generations", "packs"),
    "primitives_per_situation": Column(
        f"primitives that can be executed in a type of situation, mean of viable trees, {_AT_END}",
        "primitives",
    ),
    "tree_size": Column(f"nodes of a tree, mean of viable ones, {_AT_END}", "nodes"),
    "viable": Column(f"share of trees with a primitive for every type of situation, {_AT_END}"),
    "best_graph": Column(f"the hierarchy of the fittest, {_AT_END}"),
    "best_fitness": Column(f"packs that it brought home, {_AT_END}", "packs"),
    **{
        edge: Column(f"share of trees in which {parent} invokes {child}, {_AT_END}")
        for edge in EDGES
        for parent, child in [edge.removeprefix(EDGE).split()]
    },
}


def environments() -> dict[str, World]:
    """Return the three environments, the easiest first, and one where lives are long; lengths in steps of the robot."""
    return {
        IN_SIGHT: new_world(12.0, (6.0, 3.0), (2.0, 7.0, 10.0, 11.0), (40.0, _ALL_AROUND)),
        OUT_OF_SIGHT: new_world(20.0, (10.0, 4.0), (3.0, 10.0, 17.0, 18.0), (7.0, _ALL_AROUND)),
        WALLED: new_world(_SIZE, _NEST, _PACKS, _NEAR, _OPEN_AT_THE_RIGHT),
        WALL_IN_VIEW: new_world(_SIZE, _NEST, _PACKS, _FAR, _OPEN_AT_THE_RIGHT),
    }


def changing_worlds(change: str, is_sensed: bool) -> tuple[World, World]:
    """Return the two settings of a world that changes.

    In both a wall is open at the right; in the one of conflicting changes, then, at the left, where what was
    learnt is wrong. In the other there is no wall, and what was learnt at one does no harm.
    """
    walls = _OPEN_AT_THE_LEFT if change == CHANGES[0] else ()
    return (
        new_world(_SIZE, _NEST, _PACKS, _FAR, _OPEN_AT_THE_RIGHT),
        new_world(_SIZE, _NEST, _PACKS, _FAR, walls, cue=int(is_sensed)),
    )


def plan_jobs(plan: Plan) -> list[Job]:
    """Return the runs of both inheritances in all environments and changes, and one of drift, for each seed."""
    jobs = []
    for seed in plan.seeds:
        for inheritance in (DARWINIAN, LAMARCKIAN):
            for name in ENVIRONMENTS:
                run = partial(run_environment, name, inheritance, seed, plan.is_quick)
                jobs.append(Job(condition_of(name, inheritance), seed, run))
            for name in LONG_LIVED:
                run = partial(run_environment, name, inheritance, seed, plan.is_quick, True)
                jobs.append(Job(condition_of(name, LONG_LIVES, inheritance), seed, run))
            for change, sense in product(CHANGES, SENSES):
                run = partial(run_changes, change, sense, inheritance, seed, plan.is_quick)
                jobs.append(Job(condition_of(change, sense, inheritance), seed, run))
        jobs.append(Job(DRIFT, seed, partial(run_drift, seed, plan.is_quick)))
    return jobs


def run_environment(
    name: str, inheritance: str, seed: int, is_quick: bool, is_long: bool = False
) -> list[Row]:
    """Evolve in an environment that stays, with long lives perhaps."""
    settings = _settings(is_quick)
    if is_long and not is_quick:
        settings = replace(settings, life_steps=LONG_LIFE_STEPS)
    worlds = [environments()[name]] * _generations(is_quick)
    return _run(worlds, bring_home_subtasks(), inheritance, seed, settings)


def run_changes(change: str, sense: str, inheritance: str, seed: int, is_quick: bool) -> list[Row]:
    """Evolve in an environment that changes from each generation to the next."""
    is_sensed = sense == SENSES[1]
    worlds = changing_worlds(change, is_sensed)
    schedule = [worlds[generation % 2] for generation in range(_generations(is_quick))]
    subtasks = bring_home_subtasks(1 + is_sensed)
    return _run(schedule, subtasks, inheritance, seed, _settings(is_quick))


def run_drift(seed: int, is_quick: bool) -> Row:
    """Let trees vary without selection, but for that of those that have a primitive for every situation."""
    subtasks = bring_home_subtasks()
    stream = new_streams(seed, (6,), 1)[0]
    trees = drift(
        _settings(is_quick),
        _generations(is_quick),
        lambda tree: is_viable(tree, subtasks),
        stream,
    )
    return _describe(trees, subtasks)


def _run(
    worlds: Sequence[World], subtasks: Subtasks, inheritance: str, seed: int, settings: Settings
) -> list[Row]:
    stream = new_streams(seed, (6,), 1)[0]
    graphs = TaskGraphs(GRAMMAR, subtasks)
    evolved = evolve(settings, graphs, worlds, _INHERIT[inheritance], stream)
    fitness: FloatArray = evolved.mean_fitness
    best = int(evolved.fitness.argmax())
    found: Row = {
        "fitness_end": float(fitness[-END:].mean()),
        "fitness_late": float(fitness[fitness.size // 2 :].mean()),
        "best_graph": str(evolved.trees[best]),
        "best_fitness": float(evolved.fitness[best]),
        **_describe(evolved.trees, subtasks),
    }
    curve: list[Row] = [
        {"generation": generation, "mean_fitness": float(value)}
        for generation, value in enumerate(fitness)
    ]
    return [*curve, found]


def _describe(trees: Sequence[Tree], subtasks: Subtasks) -> Row:
    """Return what trees are like, and how often each subtask invokes each."""
    viable = [tree for tree in trees if is_viable(tree, subtasks)]
    row: Row = {"viable": len(viable) / len(trees)}
    if viable:
        counts = [primitives_per_situation(tree, subtasks) for tree in viable]
        row["primitives_per_situation"] = float(np.mean(counts))
        row["tree_size"] = float(np.mean([sum(1 for _ in tree.walk()) for tree in viable]))
    edges = [
        {
            f"{EDGE}{node.symbol} {child.symbol}"
            for _, node in tree.walk()
            for child in node.children
        }
        for tree in trees
    ]
    return row | {edge: sum(edge in one for one in edges) / len(trees) for edge in EDGES}


def _settings(is_quick: bool) -> Settings:
    return _QUICK if is_quick else Settings(TreeVariation(GRAMMAR))


def _generations(is_quick: bool) -> int:
    return _QUICK_GENERATIONS if is_quick else GENERATIONS


EXPERIMENT = Experiment(
    name="hierarchies", columns=COLUMNS, jobs=plan_jobs, measures=MEASURES, draw=draw
)
