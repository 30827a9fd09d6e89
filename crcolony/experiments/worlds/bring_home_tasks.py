"""The subtasks of which hierarchies for `bring_home` are made: primitive ones, composite ones, and who may invoke whom.

A composite subtask is a termination predicate and what its choices depend on. All this is ours: of Paper V's own
subtasks no more is known than that types restrict which may be parents of which, by state space and termination.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from crcolony.compiled import BoolArray, FloatArray, IntArray
from crcolony.evolution.typed_tree import Grammar, Symbol
from crcolony.experiments.worlds.bring_home import (
    FOLLOW_LEFT,
    FOLLOW_RIGHT,
    OBSTACLES,
    ROTATE,
    SIGHTS,
    TO_NEST,
    TO_PACK,
    WANDER,
    states,
)
from crcolony.learning.maxq.task_graph import Primitive

PRIMITIVES = {
    "Wander": WANDER,
    "Rotate": ROTATE,
    "FollowLeft": FOLLOW_LEFT,
    "FollowRight": FOLLOW_RIGHT,
    "ToPack": TO_PACK,
    "ToNest": TO_NEST,
}

SITUATIONS = ("pack unseen", "pack in sight", "nest unseen", "nest in sight")
"""The types of situations: seeking the pack, two, and carrying it, two."""

LOST = -30.0
"""Pseudo-reward of a subtask that ends because it has lost what it was approaching from sight."""

GRAMMAR = Grammar(
    root="Root",
    symbols=(
        Symbol(
            "Root",
            "root",
            frozenset({"pack", "nest", "pack part", "nest part", "move", "to pack", "to nest"}),
        ),
        Symbol("GetPack", "pack", frozenset({"pack part", "move", "to pack"})),
        Symbol("BringHome", "nest", frozenset({"nest part", "move", "to nest"})),
        Symbol("FindPack", "pack part", frozenset({"move"})),
        Symbol("ReachPack", "pack part", frozenset({"move", "to pack"})),
        Symbol("FindNest", "nest part", frozenset({"move"})),
        Symbol("ReachNest", "nest part", frozenset({"move", "to nest"})),
        Symbol("Wander", "move"),
        Symbol("Rotate", "move"),
        Symbol("FollowLeft", "move"),
        Symbol("FollowRight", "move"),
        Symbol("ToPack", "to pack"),
        Symbol("ToNest", "to nest"),
    ),
    max_depth=4,
)
"""A subtask may invoke those that can go on where it goes on, and those primitives that concern its aim."""


@dataclass(frozen=True, eq=False)
class CompositeKind:
    """What all composite subtasks of one symbol have in common."""

    terminal: BoolArray
    """(states,) the termination predicate"""
    abstraction: IntArray
    """(states,) what the completion of each child depends on"""
    pseudo_reward: FloatArray | None = None
    """(states,)"""


@dataclass(frozen=True, eq=False)
class Subtasks:
    """All subtasks, by their symbols, for robots whose sensor tells so many settings of the world apart."""

    states: int
    primitives: Mapping[str, Primitive]
    composites: Mapping[str, CompositeKind]
    situations: IntArray
    """(states,) index in SITUATIONS"""


def bring_home_subtasks(cues: int = 1) -> Subtasks:
    """Return the subtasks; with a sensor all that is learnt, it is learnt for each of its values."""
    count = states(cues)
    cue, carrying, pack, nest, obstacles = np.unravel_index(
        np.arange(count), (cues, 2, SIGHTS, SIGHTS, OBSTACLES)
    )
    carries, sees_pack, sees_nest = carrying == 1, pack > 0, nest > 0
    felt, seen = cue * OBSTACLES + obstacles, cue * SIGHTS
    pack_state, nest_state = (
        (seen + pack) * OBSTACLES + obstacles,
        (seen + nest) * OBSTACLES + obstacles,
    )
    situations = np.where(carries, 2 + sees_nest, sees_pack).astype(np.int64)
    return Subtasks(
        states=count,
        primitives={
            # A step costs 1 whatever is done, so that V of a primitive is one number.
            name: Primitive(name, action, np.zeros(count, dtype=np.int64), type=GRAMMAR[name].type)
            for name, action in PRIMITIVES.items()
        },
        composites={
            "Root": CompositeKind(
                np.zeros(count, dtype=np.bool_), cue * len(SITUATIONS) + situations
            ),
            "GetPack": CompositeKind(carries, pack_state),
            "BringHome": CompositeKind(~carries, nest_state),
            "FindPack": CompositeKind(carries | sees_pack, felt),
            "ReachPack": CompositeKind(
                carries | ~sees_pack, pack_state, np.where(~carries & ~sees_pack, LOST, 0.0)
            ),
            "FindNest": CompositeKind(~carries | sees_nest, felt),
            "ReachNest": CompositeKind(
                ~carries | ~sees_nest, nest_state, np.where(carries & ~sees_nest, LOST, 0.0)
            ),
        },
        situations=situations,
    )
