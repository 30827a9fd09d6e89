"""A host passes events to its arena and its robots, steps both together, and saves all of them."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast

import pytest

from crcolony.nodes.arena_node import ArenaNode
from crcolony.nodes.node_inputs import ColonyMember, NodeResources
from crcolony.nodes.robot_node import RobotNode
from crcolony.protocol.body_messages import BodyGranted
from crcolony.protocol.identity import RobotId, seeded
from crcolony.protocol.signed_telemetry import open_telemetry
from crcolony.protocol.telemetry_messages import (
    decode_arena_metadata,
    decode_robot_metadata,
    decode_scene,
    decode_state,
)
from crcolony.robot.factory import make_robots, own_streams
from crcolony.runtime.host_process import HostProcess
from crcolony.runtime.hosted_robots import HostedRobots
from crcolony.runtime.networked_arena import NetworkedArena, restore_arena
from crcolony.storage.files import FolderError
from crcolony.storage.store import RobotStore
from crcolony.transport.inbox import Inbox
from crcolony.transport.interface import QueryReceived, RobotOffline, RobotOnline
from tests.support.linked_robot import LinkedRobot
from tests.support.small_colony import small

KEYS = [seeded("test", 1, number) for number in range(4)]
KEY_ELSEWHERE = KEYS[3]
HERE, ELSEWHERE = [key.id for key in KEYS[:3]], KEY_ELSEWHERE.id


class RecordingTransport:
    """The transports of the arena and of the robots: what they send is recorded."""

    def __init__(self) -> None:
        self.observed: list[RobotId] = []
        self.scenes: list[bytes] = []
        self.states: list[bytes] = []
        self.online: list[RobotId] = []

    def publish_observation(self, robot: RobotId, observation: bytes) -> None:
        self.observed.append(robot)

    def publish_scene(self, scene: bytes) -> None:
        self.scenes.append(scene)

    def publish_telemetry(self, robot: RobotId, topic: str, data: bytes) -> None:
        if topic == "state":
            self.states.append(data)

    def send_envelope(self, to: RobotId, envelope: bytes) -> None: ...

    def add_robot(self, robot: RobotId, incarnation: int) -> None:
        self.online.append(robot)

    def remove_robot(self, robot: RobotId) -> None:
        if robot in self.online:
            self.online.remove(robot)


class NoConnection:
    """A connection of which nothing is due, without a roster."""

    def on_roster(self, handle: Any) -> None:
        pass

    def handle_timers(self, now_s: float) -> None:
        pass


class Setup:
    """A host with three robots and one more slot."""

    def __init__(self, folder: Path) -> None:
        config = small()
        self.transport = cast(Any, RecordingTransport())
        self.arena = ArenaNode(config, 7, lockstep=False)
        self.lines: list[str] = []
        self.checkpoint = folder / "arena.npz"
        batch, parameters, robots = make_robots(
            config, [one.hex() for one in HERE], own_streams(HERE)
        )
        self.stores, self.nodes = [], []
        for number, robot in enumerate(robots):
            schema = bytes.fromhex(robot.subpopulation.schema.digest)
            store = RobotStore(folder / f"{number}.sqlite", HERE[number], schema, durable=False)
            member = ColonyMember(KEYS[number], "test", number, store.begin_incarnation(1))
            resources = NodeResources(store, self.transport, lambda: 1_000.0)
            self.stores.append(store)
            self.nodes.append(RobotNode(member, robot, batch, resources))
        networked = NetworkedArena(
            self.arena,
            "lab",
            seeded("arena", 1, 0),
            self.transport,
            self.checkpoint,
            self.lines.append,
        )
        hosted = HostedRobots(self.nodes, batch, parameters, self.transport)
        self.process = HostProcess(
            networked, hosted, Inbox(), cast(Any, NoConnection()), self.lines.append
        )
        self.process.start("{}")

    def run(self, steps: int) -> None:
        """Run as fast as possible, for so many steps."""
        end = self.arena.tick + steps
        self.process.run(lambda: self.arena.tick >= end, None)

    def query(self, topic: Any, robot: bytes, payload: bytes = b"") -> bytes:
        """Return the reply to a query."""
        replies: list[bytes] = []
        self.process.handle_event(QueryReceived(topic, robot, payload, replies.append))
        (reply,) = replies
        return reply

    def join_from_elsewhere(self) -> LinkedRobot:
        """Let a robot of another process join."""
        robot = LinkedRobot(KEY_ELSEWHERE, "lab", self.arena.arena_run)
        reply = robot.reply(self.query("join", ELSEWHERE, robot.request()))
        assert isinstance(reply, BodyGranted)
        return robot


@pytest.fixture
def setup(tmp_path: Path) -> Iterator[Setup]:
    """A started host."""
    made = Setup(tmp_path)
    yield made
    for store in made.stores:
        store.close()


def test_robots_have_the_first_slots_and_are_online(setup: Setup) -> None:
    """In the order of their numbers."""
    assert setup.arena.robots == {robot: slot for slot, robot in enumerate(HERE)}
    assert setup.transport.online == HERE
    assert [node.arena for node in setup.nodes] == ["lab"] * 3


def test_arena_and_robots_step_together(setup: Setup) -> None:
    """Each robot makes one control step a tick, and a robot of another process is observed by messages."""
    setup.join_from_elsewhere()
    setup.run(50)
    assert [node.robot.steps for node in setup.nodes] == [50] * 3
    assert setup.transport.observed == [ELSEWHERE] * 50


def test_states_scenes_and_a_status_line_are_published(setup: Setup) -> None:
    """At the first step already."""
    setup.run(1)
    assert [
        decode_state(open_telemetry(data).content).robot for data in setup.transport.states
    ] == HERE
    assert len(decode_scene(open_telemetry(setup.transport.scenes[0]).content).robots) == 3
    assert setup.lines[0].startswith("tick 1: 3 robots here, 0 from other processes, generation 0")


def test_queries_reach_the_robot_or_the_arena(setup: Setup) -> None:
    """A metadata query without a robot is the arena's."""
    assert (
        decode_arena_metadata(open_telemetry(setup.query("metadata", b"")).content).arena == "lab"
    )
    assert (
        decode_robot_metadata(open_telemetry(setup.query("metadata", HERE[1])).content).robot
        == HERE[1]
    )


def test_robots_are_peers_of_each_other_and_never_lose_their_bodies(setup: Setup) -> None:
    """A robot of another process that goes offline does, after a while."""
    setup.join_from_elsewhere()
    for robot in (*HERE, ELSEWHERE):
        setup.process.handle_event(RobotOnline(robot, 1, "a"))
    assert [len(node.peers) for node in setup.nodes] == [3, 3, 3]
    for robot in (HERE[0], ELSEWHERE):
        setup.process.handle_event(RobotOffline(robot, 1, "a"))
    assert [len(node.peers) for node in setup.nodes] == [2, 1, 1]
    assert setup.arena.remove_absent(1e12) == [ELSEWHERE]
    assert set(setup.arena.robots) == set(HERE)


def test_a_robot_that_leaves_gives_its_body_back(setup: Setup) -> None:
    """Its slot is free again."""
    robot = setup.join_from_elsewhere()
    setup.process.handle_event(QueryReceived("join", ELSEWHERE, robot.leave(), cast(Any, None)))
    assert ELSEWHERE not in setup.arena.robots


def test_everything_is_saved_at_the_end(setup: Setup) -> None:
    """The arena resumes at the same tick with all robots offline, and the robots at their last step."""
    setup.run(20)
    setup.process.stop()
    assert not setup.transport.online
    restored = ArenaNode(small(), 8, lockstep=True)
    assert restore_arena(restored, setup.checkpoint)
    assert (restored.tick, len(restored.robots), restored.is_ready) == (20, 3, False)
    for store in setup.stores:
        loaded = store.load()
        assert loaded is not None


def test_a_damaged_checkpoint_is_refused(setup: Setup) -> None:
    """Without one an arena starts empty."""
    node = ArenaNode(small(), 8, lockstep=True)
    assert not restore_arena(node, setup.checkpoint)
    setup.checkpoint.write_bytes(b"noise")
    with pytest.raises(FolderError, match="cannot resume from it"):
        restore_arena(node, setup.checkpoint)
