"""A life of learning in the world of packs."""

import math

import numpy as np

from crcolony.compiled import IntArray
from crcolony.evolution.typed_tree import parse_tree
from crcolony.experiments.hierarchy_graphs import TaskGraphs
from crcolony.experiments.worlds.bring_home import World, new_world
from crcolony.experiments.worlds.bring_home_life import live
from crcolony.experiments.worlds.bring_home_tasks import GRAMMAR, bring_home_subtasks
from crcolony.learning.maxq.maxq_learner import MaxqQ, NodeParameters
from crcolony.randomness import new_streams

OPEN = new_world(12.0, (6.0, 3.0), (2.0, 7.0, 10.0, 11.0), (40.0, math.pi))
WALLED = new_world(
    14.0, (7.0, 2.5), (3.0, 10.0, 11.0, 13.0), (30.0, math.pi), ((0.0, 7.0, 10.0, 7.0),)
)


def lives(text: str, world: World, count: int, steps: int = 3000) -> tuple[list[int], IntArray]:
    """Return the packs that a robot brings home in each of some lives, which learn on, and its last trips."""
    graph = TaskGraphs(GRAMMAR, bring_home_subtasks()).graph_of(parse_tree(text))
    learner = MaxqQ(graph, 0.97, default=NodeParameters(0.5, 0.1, 0.95), memory=256)
    trips = np.zeros(500, dtype=np.int64)
    stream = new_streams(1, (1,), 1)[0]
    packs = [
        live(learner.learner, world, np.zeros(6), steps, 200, trips, stream) for _ in range(count)
    ]
    return packs, trips


def test_with_one_primitive_for_each_aim_there_is_nothing_to_learn() -> None:
    """Trips are as long as the way there and back, and all steps are spent on them."""
    (packs,), trips = lives("Root(GetPack(ToPack), BringHome(ToNest))", OPEN, 1)
    assert packs > 150
    assert trips[:packs].min() >= 7
    assert trips[:packs].max() <= 30
    assert 3000 - 30 < trips[:packs].sum() <= 3000


def test_a_mix_of_primitives_is_learnt_over_lives() -> None:
    """Where a wall has to be followed around its end."""
    packs, _ = lives("Root(GetPack(ToPack, FollowLeft), BringHome(ToNest, FollowRight))", WALLED, 4)
    assert packs[-1] > 80
    assert packs[-1] > 1.1 * packs[0]


def test_a_robot_that_can_do_nothing_stands_still_and_brings_nothing_home() -> None:
    """Its root has ended, at once or with the pack in its jaw; patience begins the next trip."""
    assert lives("Root(BringHome(ToNest))", OPEN, 1, 500)[0] == [0]
    assert lives("Root(GetPack(ToPack))", OPEN, 1, 500)[0] == [0]
