"""An arena opens links to the robots that prove to have its bodies, to nobody else, and leaks nothing."""

import gc
import socket
import threading
from collections.abc import Iterator

import pytest

from crcolony.protocol.body_messages import Contact, LocalLink
from crcolony.protocol.local_link import CHALLENGE_BYTES, prove_robot
from crcolony.transport import local_robots
from crcolony.transport.local_socket import HAS_LOCAL_LINKS, connect_to_arena
from tests.support.local_ends import (
    IDS,
    ArenaEnd,
    RobotEnd,
    action,
    exchange,
    linked,
    new_keys,
    observation,
    open_files,
)

pytestmark = pytest.mark.skipif(not HAS_LOCAL_LINKS, reason="there are no such links here")


@pytest.fixture
def arena() -> Iterator[ArenaEnd]:
    arena = ArenaEnd()
    yield arena
    arena.local.close()


def connect(arena: ArenaEnd) -> tuple[socket.socket, bytes]:
    """Connect as any program can; return the connection, and the arena's challenge."""
    connection = connect_to_arena(arena.run)
    assert connection is not None
    arena.handle()
    return connection, connection.recv(100)


def is_closed(connection: socket.socket) -> bool:
    """Return whether the arena has ended a connection."""
    try:
        return connection.recv(100) == b""
    except ConnectionResetError:  # before it read what was sent
        return True
    except BlockingIOError:
        return False


def test_a_link_carries_observations_and_actions(arena: ArenaEnd) -> None:
    """In both directions, with contacts; the robot's present observation is asked for when it opens."""
    robots = [RobotEnd(robot) for robot in IDS]
    for robot in robots:
        robot.open(arena)
        exchange(arena, robot)
    assert arena.opened == IDS
    assert len(arena.local) == len(IDS)
    for number, robot in enumerate(robots):
        assert robot.id in arena.local
        contact = Contact(IDS[0], number) if number else None
        arena.local.publish_observation(robot.id, 5, observation(number), contact)
        exchange(robot)
        (seen,) = robot.observations
        assert (seen.tick, seen.row[0], seen.contact) == (5, number, contact)
        robot.local.publish_action(5, action(number))
    exchange(arena)
    assert arena.actions == [(robot, 5, number) for number, robot in enumerate(IDS)]
    for robot in robots:
        robot.local.close()


def test_all_are_rung_at_once(arena: ArenaEnd) -> None:
    """For rows that the arena has written into all pages itself."""
    robots = [RobotEnd(robot) for robot in IDS[:2]]
    for robot in robots:
        robot.open(arena)
        exchange(arena, robot)
    assert (arena.local.pages.page_of >= 0).sum() == 2
    for robot in robots:
        arena.local.publish_observation(robot.id, 1, observation(), None)
        exchange(robot)
    arena.local.ring_all()
    for robot in robots:
        exchange(robot)
        assert len(robot.observations) == 2
        robot.local.close()


def test_every_action_is_yielded_once() -> None:
    """However often the doorbell rings, and however many actions came in between: the latest."""
    with linked() as (arena, robot):
        for tick in (1, 2, 3):
            robot.local.publish_action(tick, action(tick))
        exchange(arena)
        robot.local.ring()
        exchange(arena)
        assert arena.actions == [(robot.id, 3, 3.0)]
        robot.local.publish_action(4, action(4.0))
        exchange(arena)
        assert arena.actions[1:] == [(robot.id, 4, 4.0)]


def test_the_arena_wakes_when_a_robot_acts() -> None:
    """Its loop sleeps until then."""
    with linked() as (arena, robot):
        acting = threading.Timer(0.05, lambda: robot.local.publish_action(1, action()))
        acting.start()
        assert arena.inbox.get(30.0) is None
        acting.join()
        assert arena.actions == [(robot.id, 1, 0.0)]


# Who is refused -------------------------------------------------------------------------------------------------------


def test_wrong_keys_open_nothing(arena: ArenaEnd) -> None:
    """Of a robot that has a body, or of one that has none."""
    arena.keys[IDS[0]] = new_keys()
    for robot in (RobotEnd(IDS[0]), RobotEnd(IDS[1])):
        robot.open(arena, new_keys())
        exchange(arena, robot)
        assert not robot.local.is_open
        assert robot.local.page is None
    assert not len(arena.local)
    assert not arena.opened


def test_a_proof_cannot_be_used_again(arena: ArenaEnd) -> None:
    """Every connection has a challenge of its own."""
    keys = arena.keys[IDS[0]] = new_keys()
    first, challenge = connect(arena)
    proof = prove_robot(LocalLink(IDS[0], arena.run, challenge), keys)
    second, other_challenge = connect(arena)
    assert challenge != other_challenge
    second.send(proof)
    arena.handle()
    assert is_closed(second)
    assert not len(arena.local)
    first.send(proof)
    arena.handle()
    assert IDS[0] in arena.local
    first.close()
    second.close()


@pytest.mark.parametrize("noise", [b"", b"x", bytes(4096), b"\x00" * 100_000], ids=len)
def test_noise_ends_its_connection_alone(noise: bytes) -> None:
    """Whatever its length; the links of others go on."""
    with linked() as (arena, robot):
        connection, challenge = connect(arena)
        assert len(challenge) == CHALLENGE_BYTES
        connection.send(noise)
        arena.handle()
        assert is_closed(connection)
        connection.close()
        robot.local.publish_action(1, action())
        exchange(arena)
        assert arena.actions


def test_a_robot_that_says_anything_over_the_connection_loses_its_link() -> None:
    """It has nothing to say there; it goes on over the network."""
    with linked() as (arena, robot):
        assert robot.local._connection is not None
        robot.local._connection.send(b"hello")
        exchange(arena, robot)
        assert robot.id not in arena.local
        assert not robot.local.is_open


def test_connections_that_prove_nothing_are_bounded(
    arena: ArenaEnd, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The oldest makes room, so that robots still find their way in."""
    monkeypatch.setattr(local_robots, "_MAX_UNPROVED", 4)
    before = open_files()
    connections = [connect(arena)[0] for _ in range(10)]
    assert [is_closed(connection) for connection in connections] == 6 * [True] + 4 * [False]
    assert open_files() == before + len(connections) + 4
    robot = RobotEnd()
    robot.open(arena)
    exchange(arena, robot)
    assert robot.local.is_open
    robot.local.close()
    for connection in connections:
        connection.close()


def test_who_is_gone_before_its_challenge_is_no_trouble(arena: ArenaEnd) -> None:
    """A process may end at any moment."""
    before = open_files()
    for _ in range(20):
        connection = connect_to_arena(arena.run)
        assert connection is not None
        connection.close()
        exchange(arena)
    assert open_files() == before


# Ends -----------------------------------------------------------------------------------------------------------------


def test_a_newer_connection_of_a_robot_replaces_the_earlier() -> None:
    """Its process was killed and restarted, and the end of the former has not been noticed; a new page is used."""
    with linked() as (arena, former):
        page = int(arena.local.pages.page_of[0])
        robot = RobotEnd(former.id)
        robot.open(arena)
        exchange(arena, robot)
        assert robot.local.is_open
        assert len(arena.local) == 1
        assert arena.local.pages.page_of[0] != page
        arena.local.publish_observation(robot.id, 9, observation(), None)
        exchange(robot, former)
        assert [seen.tick for seen in robot.observations] == [9]
        assert not former.observations
        assert not former.local.is_open
        robot.local.publish_action(9, action())
        exchange(arena, former)
        assert arena.actions == [(robot.id, 9, 0.0)], "its end is not that of the new one"
        robot.local.close()


def test_the_end_of_a_robot_ends_its_link() -> None:
    """Its rows are for the network then, and its page is free."""
    with linked() as (arena, robot):
        robot.local.close()
        exchange(arena)
        assert robot.id not in arena.local
        assert (arena.local.pages.page_of < 0).all()


def test_the_end_of_a_connection_is_the_end_of_its_link() -> None:
    """As the kernel ends it when a process is killed."""
    with linked() as (arena, robot):
        assert robot.local._connection is not None
        robot.local._connection.shutdown(socket.SHUT_RDWR)
        exchange(arena)
        assert robot.id not in arena.local


def test_a_robot_without_a_body_has_no_link() -> None:
    """It is removed, and its process goes on without; to remove it twice is no harm."""
    with linked() as (arena, robot):
        arena.local.remove(robot.id)
        arena.local.remove(robot.id)
        exchange(robot)
        assert not robot.local.is_open
        assert robot.id not in arena.local


def test_the_end_of_the_arena_ends_all_links() -> None:
    """Nobody can connect any more."""
    with linked() as (arena, robot):
        other, _ = connect(arena)
        arena.local.close()
        exchange(robot)
        assert not robot.local.is_open
        assert is_closed(other)
        assert connect_to_arena(arena.run) is None
        other.close()
        arena.local = ArenaEnd().local


def test_no_descriptor_is_left() -> None:
    """After links that were opened, replaced, refused and closed from both ends, and arenas that have ended."""

    def come_and_go(times: int) -> int:
        for _ in range(times):
            arena = ArenaEnd()
            robots = [RobotEnd(robot) for robot in (*IDS, *IDS)]
            for robot in robots:
                robot.open(arena)
                exchange(arena, robot)
            refused = RobotEnd()
            refused.open(arena, new_keys())
            exchange(arena, *robots, refused)
            assert len(arena.local) == len(IDS)
            for robot in robots[: len(IDS) + 2]:
                robot.local.close()
            exchange(arena)
            arena.local.close()
            exchange(*robots)
            del arena, robots, robot, refused
        gc.collect()
        return open_files()

    before = come_and_go(1)
    assert come_and_go(5) == before
