"""The world of an arena is that of an in-process colony, and its bodies fulfil the contract of all bodies."""

import io
from pathlib import Path

import numpy as np
import pytest

from crcolony.body import contract
from crcolony.body.contract import Body
from crcolony.body.contract_test import BodyContract, random_action
from crcolony.compiled import FloatArray
from crcolony.config import Config
from crcolony.evolution.history import Mated
from crcolony.in_process.colony import InProcessColony
from crcolony.nodes.arena_node import ArenaNode
from crcolony.protocol.body_messages import (
    Action,
    decode_action,
    decode_observation,
    pack_row,
    unpack_row,
)
from crcolony.protocol.codec import encode
from crcolony.protocol.identity import RobotId
from crcolony.robot.factory import make_robots, numbered_streams
from crcolony.robot.robot import Robot
from crcolony.robot.state import SLICE_OVER
from crcolony.storage.checkpoint import read_checkpoint, write_checkpoint
from tests.support.arena_nodes import IDS, filled_node, join, new_node
from tests.support.small_colony import Recorder, small


def lone_robot(config: Config, number: int) -> Robot:
    """Return one robot of a colony in a batch of its own, as in its own process."""
    streams = numbered_streams(config.seed, number, 1)
    robot = make_robots(config, [str(number)], streams)[2][0]
    robot.start()
    return robot


def test_robots_that_exchange_messages_share_the_world_of_an_in_process_colony() -> None:
    """Until the first mating every pose and every pack is the same in every tick, bit for bit."""
    config = small("seed=16")
    recorder = Recorder()
    colony = InProcessColony(config, recorder)
    colony.start()
    node = ArenaNode(config, 7, lockstep=True, expect=4)
    robots = {IDS[number]: lone_robot(config, number) for number in range(4)}
    for number in (2, 0, 3, 1):
        join(node, number, number=number)
    while True:
        colony.run(1)
        if recorder.all(Mated):
            break
        assert node.is_ready
        node.step()
        assert np.array_equal(node.arena.world.poses, colony.arena.world.poses)
        assert np.array_equal(node.arena.world.packs, colony.arena.world.packs)
        for name, robot in robots.items():
            assert not node.is_ready
            observation = decode_observation(node.observation(name))
            reply = Action(observation.tick, pack_row(robot.step(unpack_row(observation.row))))
            if robot.events & SLICE_OVER:
                assert robot.hand_over()
            assert node.apply_action(name, decode_action(encode(reply)))
    assert node.tick > 500


def test_robots_of_the_same_process_set_their_actions_directly() -> None:
    """The world is the same as with messages, and in lockstep they count as having acted."""
    node, direct = filled_node(), filled_node()
    rng = np.random.default_rng(1)
    for _ in range(50):
        for robot in range(4):
            wanted = random_action(rng)
            assert node.apply_action(IDS[robot], Action(node.tick, pack_row(wanted)))
            assert not direct.is_ready
            direct.set_action(direct.robots[IDS[robot]], wanted)
        assert direct.is_ready
        node.step()
        direct.step()
        assert node.observation(IDS[0]) == direct.observation(IDS[0])
    assert np.array_equal(node.arena.world.poses, direct.arena.world.poses)


@pytest.mark.parametrize("storage", ["memory", "checkpoint"])
def test_a_restored_arena_continues_identically(storage: str, tmp_path: Path) -> None:
    """Also from between two actions of a tick, and from a file: the same slots, observations, poses and scenes."""
    node = filled_node("body.observation_latency_steps=1")
    node.leave(IDS[2])
    join(node, 5, "other")
    rng = np.random.default_rng(2)
    for _ in range(30):
        for robot in node.waiting_for:
            node.apply_action(robot, Action(node.tick, pack_row(random_action(rng))))
        node.step()
    node.apply_action(IDS[3], Action(node.tick, pack_row(random_action(rng))))
    saved = node.save()
    if storage == "checkpoint":
        buffer = io.BytesIO()
        write_checkpoint(buffer, saved)
        (tmp_path / "arena.npz").write_bytes(buffer.getvalue())
        saved = read_checkpoint(tmp_path / "arena.npz")
    other = new_node("body.observation_latency_steps=1")
    other.restore(saved)
    futures = []
    for one in (node, other):
        again = np.random.default_rng(3)
        assert [IDS.index(robot) for robot in one.waiting_for] == [0, 1, 5]
        for _ in range(30):
            for robot in one.waiting_for:
                one.apply_action(robot, Action(one.tick, pack_row(random_action(again))))
            one.step()
        futures.append([one.observation(robot) for robot in one.robots])
        futures[-1].append(encode(one.scene("arena", 1, 2)))
    assert futures[0] == futures[1]


def test_a_saved_arena_of_other_settings_is_refused() -> None:
    """The error names the reason."""
    with pytest.raises(ValueError, match="does not fit"):
        new_node("robots=5").restore(new_node().save())


class NodeBody:
    """A body behind encoded messages, as in a robot's process, without the network."""

    def __init__(self, node: ArenaNode, robot: RobotId) -> None:
        self._node, self._robot = node, robot
        self._tick = 0

    def read(self) -> FloatArray:
        self._node.step()
        observation = decode_observation(self._node.observation(self._robot))
        self._tick = observation.tick
        return unpack_row(observation.row)

    def act(self, action: FloatArray) -> FloatArray:
        applied = contract.clip_action(action)
        message = encode(Action(self._tick, pack_row(applied)))
        self._node.apply_action(self._robot, decode_action(message))
        return applied

    def close(self) -> None:
        self._node.leave(self._robot)


class TestNodeBody(BodyContract):
    """A body behind messages fulfils the contract, with all its senses."""

    def new_body(self) -> Body:
        senses = ("body.infrared=true", "body.inertial=true", "body.microphones=true")
        node = new_node(*senses, "arena.width_m=2.0", lockstep=False)
        join(node, 0)
        return NodeBody(node, IDS[0])
