"""Robots and bodies of one machine find each other if they are of one user, and nothing is left of the address."""

import os
import socket
import subprocess
import sys
from collections.abc import Iterator

import pytest

from crcolony.transport.local_socket import (
    HAS_LOCAL_LINKS,
    connect_to_arena,
    is_of_this_user,
    listen_for_robots,
)
from tests.support.local_ends import new_run, open_files
from tests.support.paths import PYTHONPATH, ROOT

pytestmark = pytest.mark.skipif(not HAS_LOCAL_LINKS, reason="there are no such sockets here")
RUN = new_run()


@pytest.fixture
def listening() -> Iterator[socket.socket]:
    listening = listen_for_robots(RUN)
    yield listening
    listening.close()


def is_listed(run: int) -> bool:
    """Return whether the system knows a socket of this run of an arena."""
    with open("/proc/net/unix") as sockets:
        return any(f"/arena/{run}" in line for line in sockets)


def test_messages_arrive_whole(listening: socket.socket) -> None:
    """Each by itself, from a process of the same user."""
    robot = connect_to_arena(RUN)
    assert robot is not None
    arena, _ = listening.accept()
    assert is_of_this_user(arena)
    robot.send(b"one")
    robot.send(b"two")
    assert (arena.recv(100), arena.recv(100)) == (b"one", b"two")
    for end in (robot, arena):
        assert not os.get_inheritable(end.fileno())
        end.close()


def test_nobody_is_waited_for(listening: socket.socket) -> None:
    """A robot's loop goes on."""
    with pytest.raises(BlockingIOError):
        listening.accept()
    robot = connect_to_arena(RUN)
    assert robot is not None
    with pytest.raises(BlockingIOError):
        robot.recv(100)
    robot.close()


def test_an_arena_that_is_not_here_is_not_found() -> None:
    """Nor is another run found; and nothing stays open."""
    before = open_files()
    assert connect_to_arena(RUN) is None
    with listen_for_robots(RUN):
        assert connect_to_arena(RUN + 1) is None
    assert open_files() == before


def test_where_such_sockets_are_not_allowed_nobody_is_found(
    listening: socket.socket, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As for a service that may use addresses of the network alone: a robot goes on there."""

    def refuse(*_: int) -> socket.socket:
        raise PermissionError

    monkeypatch.setattr(socket, "socket", refuse)
    assert connect_to_arena(RUN) is None
    with pytest.raises(OSError):
        listen_for_robots(RUN + 1)


def test_a_run_has_one_address(listening: socket.socket) -> None:
    """A second process cannot take it; of its attempt nothing stays open."""
    before = open_files()
    with pytest.raises(OSError, match="in use"):
        listen_for_robots(RUN)
    assert open_files() == before


def test_nothing_is_left_of_the_address() -> None:
    """It is no file, and free as soon as the socket is closed."""
    with listen_for_robots(RUN):
        assert is_listed(RUN)
    assert not is_listed(RUN)
    listen_for_robots(RUN).close()


def test_another_user_is_not_believed(
    listening: socket.socket, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By neither end: the kernel says whose process the other is."""
    robot = connect_to_arena(RUN)
    assert robot is not None
    arena, _ = listening.accept()
    user = os.geteuid()
    monkeypatch.setattr(os, "geteuid", lambda: user + 1)
    assert not is_of_this_user(arena)
    assert not is_of_this_user(robot)
    before = open_files()
    assert connect_to_arena(RUN) is None
    assert open_files() == before
    for end in (robot, arena):
        end.close()


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can start processes of another user")
def test_a_process_of_another_user_is_refused(listening: socket.socket) -> None:
    """A real one: it finds no arena, and the arena sees that it is of another user."""
    program = f"""
import os
from crcolony.transport.local_socket import connect_to_arena
os.setuid(65534)
print(connect_to_arena({RUN}))
"""
    done = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": PYTHONPATH},
    )
    assert done.stdout.strip() == "None", done.stderr
    arena, _ = listening.accept()
    assert not is_of_this_user(arena)
    arena.close()
