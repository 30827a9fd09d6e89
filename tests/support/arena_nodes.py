"""Arenas as robots join them, for tests: small ones, with and without robots."""

import numpy as np

from crcolony.body import contract
from crcolony.nodes.arena_node import ArenaNode
from crcolony.protocol.body_messages import Action, BodyGranted, pack_row
from crcolony.protocol.identity import seeded
from tests.support.small_colony import small

IDS = [seeded("test", 1, number).id for number in range(8)]
ARENA_RUN = 7


def new_node(*settings: str, lockstep: bool = True, expect: int = 0) -> ArenaNode:
    """Return an arena with four slots and no robots."""
    return ArenaNode(small(*settings), ARENA_RUN, lockstep, expect)


def join(node: ArenaNode, robot: int, colony: str = "test", number: int = -1) -> BodyGranted:
    """Let a robot join; return the grant of its body."""
    return node.grant(node.join(IDS[robot], colony, number), bytes(16), bytes(32))


def filled_node(*settings: str, lockstep: bool = True) -> ArenaNode:
    """Return an arena with four robots, after one tick."""
    node = new_node(*settings, lockstep=lockstep)
    for robot in range(4):
        join(node, robot)
    node.step()
    return node


def forward(node: ArenaNode, speed_m_s: float = 0.1, ttl_s: float = 0.5, age: int = 0) -> Action:
    """Return an action that drives straight on; `age` is the number of ticks since its observation."""
    row = np.zeros(contract.ACTION_WIDTH)
    row[[contract.WHEEL_LEFT, contract.WHEEL_RIGHT]] = speed_m_s
    row[contract.TTL] = ttl_s
    return Action(node.tick - age, pack_row(row))


def awaited(node: ArenaNode) -> list[int]:
    """Return the numbers of the robots whose actions the arena waits for."""
    return [IDS.index(robot) for robot in node.waiting_for]
