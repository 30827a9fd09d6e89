"""The process of an arena or a bridge shares memory with robots that have its bodies, where that is possible."""

from collections.abc import Callable, Iterator

import pytest

from crcolony.body_server.body_server import BodyServer
from crcolony.nodes.arena_node import ArenaNode
from crcolony.protocol.identity import RobotId, seeded
from crcolony.runtime import local_robots
from crcolony.runtime.local_robots import accept_local_robots
from crcolony.transport.inbox import Inbox
from crcolony.transport.interface import NoRobotsOnThisMachine, QueryReceived, RobotOnline
from crcolony.transport.local_socket import HAS_LOCAL_LINKS, listen_for_robots
from tests.support.linked_robot import LinkedRobot
from tests.support.local_ends import RobotEnd, action, new_run
from tests.support.small_colony import small

linux = pytest.mark.skipif(not HAS_LOCAL_LINKS, reason="there are no such links here")
ROBOTS = [seeded("test", 1, number) for number in range(2)]
LATE_S = 100.0


class Arena:
    """An arena's node and server, with its end of links on this machine."""

    def __init__(self, takes_all: bool = False) -> None:
        self.inbox, self.run = Inbox(), new_run()
        self.node = ArenaNode(small(), self.run, lockstep=True)
        self.server = BodyServer(self.node, seeded("arena", 1, 0), name="arena")
        self.published: list[RobotId] = []
        """Robots to which an observation was sent over the network"""
        take = lambda: self.node.take_actions(self.server.local_robots.pages)  # noqa: E731
        accept_local_robots(
            self.server, self.node, self.inbox, self._publish, take if takes_all else None
        )

    def _publish(self, robot: RobotId, observation: bytes) -> None:
        self.published.append(robot)

    def publish(self) -> None:
        """Publish the observations of all bodies."""
        self.server.publish_observations(self.node.robots, self._publish)

    def give_body(self, robot: LinkedRobot) -> None:
        """Let a robot come online and join."""
        self.server.handle_event(LATE_S, RobotOnline(robot.id, 1, "session"))
        replies: list[bytes] = []
        join = QueryReceived("join", robot.id, robot.request(), replies.append)
        self.server.handle_event(LATE_S, join)
        robot.reply(replies[0])

    def close(self) -> None:
        self.server.local_robots.close()

    def exchange(self, end: RobotEnd) -> None:
        for _ in range(8):
            self.inbox.get(0.0)
            end.handle()


@pytest.fixture
def arena() -> Iterator[Arena]:
    arena = Arena()
    yield arena
    arena.close()


@pytest.fixture
def end() -> Iterator[RobotEnd]:
    end = RobotEnd(ROBOTS[0].id)
    yield end
    end.local.close()


def joined(arena: Arena, number: int = 0) -> LinkedRobot:
    """Return a robot with a body."""
    robot = LinkedRobot(ROBOTS[number], "arena", arena.run)
    arena.give_body(robot)
    return robot


def link(arena: Arena, end: RobotEnd) -> LinkedRobot:
    """Return a robot with a body and an open link."""
    robot = joined(arena)
    end.local.open(robot.id, arena.run, robot.keys)
    arena.exchange(end)
    assert end.local.is_open
    return robot


@linux
def test_an_observation_that_is_not_answered_is_repeated_when_the_link_opens(
    arena: Arena, end: RobotEnd
) -> None:
    """It may have been lost before; nothing of it goes over the network."""
    robot = joined(arena)
    arena.node.step()
    end.local.open(robot.id, arena.run, robot.keys)
    arena.exchange(end)
    assert {seen.tick for seen in end.observations} == {arena.node.tick}
    assert not arena.published


@linux
def test_a_robot_gets_no_observation_of_the_tick_in_which_it_has_joined(
    arena: Arena, end: RobotEnd
) -> None:
    """It steps from the next one on, as over the network, however soon the link opens: the history is the same."""
    link(arena, end)
    assert not end.observations
    arena.node.step()
    arena.publish()
    arena.exchange(end)
    assert [seen.tick for seen in end.observations] == [arena.node.tick]


@linux
def test_observations_take_the_way_that_each_robot_has(arena: Arena, end: RobotEnd) -> None:
    """Shared memory, or the network."""
    link(arena, end)
    other = joined(arena, 1)
    arena.node.step()
    arena.publish()
    arena.exchange(end)
    assert end.observations[-1].tick == arena.node.tick
    assert arena.published == [other.id]


@linux
@pytest.mark.parametrize("takes_all", [False, True], ids=["one by one", "all at once"])
def test_actions_are_applied(end: RobotEnd, takes_all: bool) -> None:
    """By the same rules as those of the network, as a bridge and as an arena takes them."""
    arena = Arena(takes_all)
    robot = link(arena, end)
    arena.node.step()
    assert arena.node.waiting_for == [robot.id]
    end.local.publish_action(arena.node.tick, action(0.1))
    arena.exchange(end)
    assert not arena.node.waiting_for
    end.local.publish_action(arena.node.tick + 1, action(0.1))
    end.local.publish_action(arena.node.tick - 1, action(0.1))
    arena.exchange(end)
    assert arena.node.counts == {"stale": 1}
    arena.close()


@linux
def test_who_has_no_body_gets_no_memory(arena: Arena, end: RobotEnd) -> None:
    """Though it has keys, of a body that it has left."""
    robot = joined(arena)
    arena.server.handle_event(
        LATE_S, QueryReceived("join", robot.id, robot.leave(), lambda reply: None)
    )
    assert robot.id not in arena.node.robots
    end.local.open(robot.id, arena.run, robot.keys)
    arena.exchange(end)
    assert not end.local.is_open


@linux
@pytest.mark.parametrize("way", ["leaves", "is absent"])
def test_the_link_ends_with_the_body(arena: Arena, end: RobotEnd, way: str) -> None:
    """When a robot leaves, and when it has been offline for too long."""
    robot = link(arena, end)
    if way == "leaves":
        left = QueryReceived("join", robot.id, robot.leave(), lambda reply: None)
        arena.server.handle_event(LATE_S, left)
    else:
        arena.node.mark_offline(robot.id, LATE_S)
        arena.server.remove_absent(LATE_S + 1e6)
    assert robot.id not in arena.server.local_robots
    arena.exchange(end)
    assert not end.local.is_open


def on_another_system(monkeypatch: pytest.MonkeyPatch, run: int) -> None:
    monkeypatch.setattr(local_robots, "HAS_LOCAL_LINKS", False)


def where_the_address_is_taken(monkeypatch: pytest.MonkeyPatch, run: int) -> None:
    monkeypatch.setattr(local_robots, "LocalRobots", lambda *_: listen_for_robots(run))


@pytest.mark.parametrize(
    "prepare",
    [on_another_system, pytest.param(where_the_address_is_taken, marks=linux)],
    ids=["no such links", "address in use"],
)
def test_where_it_is_impossible_all_use_the_network(
    monkeypatch: pytest.MonkeyPatch, prepare: Callable[[pytest.MonkeyPatch, int], None]
) -> None:
    """On other systems, and where the address or the memory cannot be had."""
    run = new_run()
    taken = listen_for_robots(run) if HAS_LOCAL_LINKS else None
    prepare(monkeypatch, run)
    arena = Arena()
    robot = joined(arena)
    arena.publish()
    assert isinstance(arena.server.local_robots, NoRobotsOnThisMachine)
    assert arena.published == [robot.id]
    arena.close()
    if taken is not None:
        taken.close()
