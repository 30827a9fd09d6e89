"""A robot opens a link to the process of its body alone, and goes on over the network where there is none."""

import os
import socket
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass

import pytest

from crcolony.body.shared_pages import PAGE_BYTES
from crcolony.protocol.body_messages import LocalLink
from crcolony.protocol.link_keys import LinkKeys
from crcolony.protocol.local_link import CHALLENGE_BYTES, prove_body, prove_robot
from crcolony.transport.local_socket import HAS_LOCAL_LINKS, PAGE_NUMBER, listen_for_robots
from crcolony.transport.shared_rows import SharedPages
from tests.support.local_ends import (
    ArenaEnd,
    RobotEnd,
    action,
    exchange,
    linked,
    new_keys,
    new_run,
    observation,
    open_files,
)

pytestmark = pytest.mark.skipif(not HAS_LOCAL_LINKS, reason="there are no such links here")
CHALLENGE = bytes(CHALLENGE_BYTES)


@dataclass
class Impostor:
    """A program that has taken the address of a run of an arena, and what it can send."""

    listening: socket.socket
    run: int
    keys: LinkKeys
    robot: RobotEnd
    connection: socket.socket

    @property
    def link(self) -> LocalLink:
        return LocalLink(self.robot.id, self.run, CHALLENGE)

    def send(self, data: bytes, *descriptors: int) -> None:
        socket.send_fds(self.connection, [data], descriptors)
        self.robot.handle()

    @property
    def is_left(self) -> bool:
        """Whether the robot has closed the connection."""
        self.connection.setblocking(False)
        try:
            return self.connection.recv(4096) == b""
        except ConnectionResetError:
            return True
        except BlockingIOError:
            return False


@pytest.fixture
def impostor() -> Iterator[Impostor]:
    run, keys, robot = new_run(), new_keys(), RobotEnd()
    listening = listen_for_robots(run)
    robot.local.open(robot.id, run, keys)
    connection, _ = listening.accept()
    yield Impostor(listening, run, keys, robot, connection)
    robot.local.close()
    connection.close()
    listening.close()


def test_without_an_arena_here_nothing_is_open() -> None:
    """It is on another machine; nothing is left open either."""
    robot = RobotEnd()
    before = open_files()
    robot.local.open(robot.id, new_run(), new_keys())
    robot.handle()
    assert not robot.local.is_open
    assert robot.local.page is None
    assert robot.local.wait_for_quiet(time.monotonic() + 10.0) is None, "nobody waits for it"
    robot.local.observe()
    robot.local.close()
    assert open_files() == before
    assert not robot.observations


def test_a_link_that_is_open_stays_open() -> None:
    """To the same run; to another one it is opened anew."""
    with linked() as (arena, robot):
        page = robot.local.page
        robot.open(arena)
        exchange(arena, robot)
        assert robot.local.page is page
        other = ArenaEnd()
        robot.open(other)
        exchange(arena, other, robot)
        assert robot.local.is_open
        assert robot.local.page is not page
        assert robot.id in other.local
        assert robot.id not in arena.local
        robot.local.close()
        other.local.close()


def test_a_link_that_was_closed_can_be_opened_again() -> None:
    """As after a body that was removed and granted again."""
    with linked() as (arena, robot):
        for _ in range(3):
            arena.local.remove(robot.id)
            exchange(robot)
            assert not robot.local.is_open
            robot.open(arena)
            exchange(arena, robot)
            assert robot.local.is_open
            robot.local.publish_action(1, action())
            exchange(arena)
            assert arena.actions.pop() == (robot.id, 1, 0.0)


def test_what_was_published_before_the_link_was_open_is_received() -> None:
    """The arena writes the present observation as soon as it knows the robot."""
    arena, robot = ArenaEnd(), RobotEnd()
    robot.open(arena)
    while robot.id not in arena.local:
        arena.handle()
        if robot.id not in arena.local:
            robot.handle()
    arena.local.publish_observation(robot.id, 3, observation(0.5), None)
    exchange(robot)
    assert {seen.tick for seen in robot.observations} == {3}
    robot.local.close()
    arena.local.close()


# Waiting for nothing but observations ---------------------------------------------------------------------------------


def test_a_bell_is_quiet() -> None:
    """The observation is on the page, and not in the inbox."""
    with linked() as (arena, robot):
        ringing = threading.Timer(
            0.05, lambda: arena.local.publish_observation(robot.id, 1, observation(), None)
        )
        ringing.start()
        assert robot.local.wait_for_quiet(time.monotonic() + 30.0) is not None
        ringing.join()
        assert robot.inbox.is_empty
        robot.local.observe()
        robot.handle()
        assert [seen.tick for seen in robot.observations] == [1]


def test_anything_else_is_not_quiet() -> None:
    """The loop is left for what was woken, for the end of the link, and at the time that was said."""
    with linked() as (arena, robot):
        assert robot.local.wait_for_quiet(time.monotonic() - 1.0) is None
        assert robot.local.wait_for_quiet(time.monotonic() + 0.001) is None
        robot.inbox.wake()
        assert robot.local.wait_for_quiet(time.monotonic() + 30.0) is None
        arena.local.publish_observation(robot.id, 1, observation(), None)
        robot.inbox.wake()
        assert robot.local.wait_for_quiet(time.monotonic() + 30.0) is None
        robot.handle()
        assert [seen.tick for seen in robot.observations] == [1], "nor is the observation lost"
        arena.local.remove(robot.id)
        assert robot.local.wait_for_quiet(time.monotonic() + 30.0) is None
        assert not robot.local.is_open
        assert robot.local.wait_for_quiet(time.monotonic() + 30.0) is None


# Impostors ------------------------------------------------------------------------------------------------------------


def descriptors_of(memory: int) -> list[int]:
    return [memory, *(os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC) for _ in range(2))]


def test_the_true_arena_is_believed(impostor: Impostor) -> None:
    """Or the tests below show nothing."""
    memory = SharedPages(1)
    impostor.send(CHALLENGE)
    assert impostor.connection.recv(4096) == prove_robot(impostor.link, impostor.keys)
    sent = descriptors_of(memory.descriptor)
    impostor.send(prove_body(impostor.link, impostor.keys) + PAGE_NUMBER.pack(3), *sent)
    assert impostor.robot.local.is_open
    for descriptor in sent:
        os.close(descriptor)


@pytest.mark.parametrize("challenge", [b"", b"short", bytes(CHALLENGE_BYTES + 1), bytes(60_000)])
def test_a_challenge_of_another_length_is_not_answered(
    impostor: Impostor, challenge: bytes
) -> None:
    """Nobody learns a proof for what it chooses."""
    impostor.send(challenge)
    assert impostor.is_left
    assert not impostor.robot.local.is_open


@pytest.mark.parametrize("reply", ["other keys", "its own proof", "noise", "short", "no page"])
def test_who_has_not_the_keys_gives_no_memory(impostor: Impostor, reply: str) -> None:
    """The link ends, and what was handed over is closed."""
    memory = SharedPages(1)
    impostor.send(CHALLENGE)
    proof = impostor.connection.recv(4096)
    number = PAGE_NUMBER.pack(0)
    data = {
        "other keys": prove_body(impostor.link, new_keys()) + number,
        "its own proof": proof + number,
        "noise": bytes(100),
        "short": b"x",
        "no page": prove_body(impostor.link, impostor.keys) + PAGE_NUMBER.pack(2**31),
    }[reply]
    before = open_files()
    sent = descriptors_of(memory.descriptor)
    impostor.send(data, *sent)
    for descriptor in sent[1:]:
        os.close(descriptor)
    assert not impostor.robot.local.is_open
    assert impostor.is_left
    assert open_files() == before - 1, "but the robot's end of the connection"
    memory.close()


@pytest.mark.parametrize("count", [0, 1, 2])
def test_memory_without_both_doorbells_is_not_used(impostor: Impostor, count: int) -> None:
    """Where the kernel has dropped descriptors, since too many files are open."""
    memory = SharedPages(1)
    impostor.send(CHALLENGE)
    before = open_files()
    sent = descriptors_of(memory.descriptor)
    data = prove_body(impostor.link, impostor.keys) + PAGE_NUMBER.pack(0)
    impostor.send(data, *sent[:count])
    for descriptor in sent[1:]:
        os.close(descriptor)
    assert not impostor.robot.local.is_open
    assert open_files() == before - 1
    memory.close()


def test_memory_that_could_be_taken_away_is_not_used(impostor: Impostor) -> None:
    """Whoever reads a page that is no more is killed by the system."""
    memory = os.memfd_create("unsealed", os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
    os.ftruncate(memory, 4 * PAGE_BYTES)
    impostor.send(CHALLENGE)
    impostor.connection.recv(4096)
    sent = descriptors_of(memory)
    impostor.send(prove_body(impostor.link, impostor.keys) + PAGE_NUMBER.pack(0), *sent)
    for descriptor in sent:
        os.close(descriptor)
    assert not impostor.robot.local.is_open
    assert impostor.is_left


def test_an_open_link_ends_when_anything_is_sent() -> None:
    """The arena has nothing to say but its end."""
    with linked() as (arena, robot):
        there = arena.local._robots[robot.id]
        there.connection.send(b"hello")
        exchange(robot)
        assert not robot.local.is_open
