"""The subtasks of which hierarchies are made: what ends where, and what is learnt of what."""

import numpy as np

from crcolony.experiments.worlds.bring_home import OBSTACLES, SIGHTS, states
from crcolony.experiments.worlds.bring_home_tasks import (
    GRAMMAR,
    LOST,
    PRIMITIVES,
    SITUATIONS,
    bring_home_subtasks,
)


def state_of(cues: int, *factors: int) -> int:
    """Return the state of cue, carrying, pack, nest and obstacles."""
    return int(np.ravel_multi_index(factors, (cues, 2, SIGHTS, SIGHTS, OBSTACLES)))


def test_every_symbol_is_a_subtask() -> None:
    """Leaves primitive ones, others composite, each at its action once."""
    subtasks = bring_home_subtasks()
    leaves = {symbol.name for symbol in GRAMMAR.symbols if not symbol.accepts}
    assert leaves == subtasks.primitives.keys() == PRIMITIVES.keys()
    assert {symbol.name for symbol in GRAMMAR.symbols} - leaves == subtasks.composites.keys()
    assert sorted(PRIMITIVES.values()) == list(range(len(PRIMITIVES)))


def test_subtasks_end_when_their_aim_is_reached_or_lost() -> None:
    """Which one goes on depends on carrying and on what is in sight; loss alone is punished."""
    subtasks = bring_home_subtasks()
    seek = {"GetPack", "Root"}
    expected = {
        (0, 0, 0): {*seek, "FindPack"},
        (0, 0, 3): {*seek, "FindPack"},
        (0, 5, 0): {*seek, "ReachPack"},
        (1, 0, 0): {"Root", "BringHome", "FindNest"},
        (1, 0, 2): {"Root", "BringHome", "ReachNest"},
    }
    for (carrying, pack, nest), active in expected.items():
        state = state_of(1, 0, carrying, pack, nest, 1)
        found = {name for name, kind in subtasks.composites.items() if not kind.terminal[state]}
        assert found == active
    reach = subtasks.composites["ReachPack"].pseudo_reward
    assert reach is not None
    assert reach[state_of(1, 0, 0, 0, 0, 0)] == LOST
    assert reach[state_of(1, 0, 1, 0, 0, 0)] == 0.0


def test_what_is_learnt_is_learnt_apart_for_each_setting_that_is_sensed() -> None:
    """And depends on what concerns the subtask alone: ReachPack's choices not on the nest."""
    subtasks = bring_home_subtasks(2)
    assert subtasks.states == states(2)
    for kind in subtasks.composites.values():
        half = states(2) // 2
        assert not set(kind.abstraction[:half]) & set(kind.abstraction[half:])
    reach = subtasks.composites["ReachPack"].abstraction
    assert reach[state_of(2, 1, 0, 4, 0, 3)] == reach[state_of(2, 1, 0, 4, 6, 3)]
    assert reach[state_of(2, 1, 0, 4, 0, 3)] != reach[state_of(2, 1, 0, 4, 0, 2)]
    assert reach[state_of(2, 1, 0, 4, 0, 3)] != reach[state_of(2, 0, 0, 4, 0, 3)]


def test_situations_are_carrying_and_sight() -> None:
    """Of pack or nest, whichever is sought."""
    situations = bring_home_subtasks().situations
    assert SITUATIONS[situations[state_of(1, 0, 0, 0, 5, 0)]] == "pack unseen"
    assert SITUATIONS[situations[state_of(1, 0, 0, 5, 0, 0)]] == "pack in sight"
    assert SITUATIONS[situations[state_of(1, 0, 1, 0, 0, 0)]] == "nest unseen"
    assert SITUATIONS[situations[state_of(1, 0, 1, 0, 5, 0)]] == "nest in sight"
