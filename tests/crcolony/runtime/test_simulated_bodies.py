"""An emergency stop holds simulated bodies as it holds physical ones."""

import threading

import numpy as np

from crcolony.runtime.simulated_bodies import SimulatedBodies
from tests.support.arena_nodes import IDS, filled_node, forward


def test_no_body_moves_while_it_is_held_and_all_do_again() -> None:
    """Whatever robots command meanwhile."""
    node = filled_node(lockstep=False)
    bodies = SimulatedBodies(node)
    holding = threading.Thread(target=bodies.hold)
    holding.start()
    while holding.is_alive():
        node.step()
    held = node.arena.world.poses.copy()
    for _ in range(5):
        node.step()
        for robot in IDS[:4]:
            node.apply_action(robot, forward(node, 0.1))
    node.step()
    np.testing.assert_allclose(node.arena.world.poses, held, atol=1e-9)
    assert bodies.release()
    for _ in range(5):
        for robot in IDS[:4]:
            assert node.apply_action(robot, forward(node, 0.1))
        node.step()
    assert np.abs(node.arena.world.poses - held).max() > 0.01


def test_an_arena_that_makes_no_tick_is_still() -> None:
    """As one in lockstep that waits."""
    node = filled_node()
    assert SimulatedBodies(node).hold()
    assert SimulatedBodies(node).count == 4
