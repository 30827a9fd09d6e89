"""The links of an arena or a bridge to the robots on its machine (Linux): a page and a doorbell for each of them."""

import contextlib
import os
import secrets
import socket
import weakref
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from crcolony.body.shared_pages import Pages
from crcolony.compiled import FloatArray
from crcolony.protocol.body_messages import Contact
from crcolony.protocol.codec import MAX_BODY_MESSAGE_BYTES, WireError
from crcolony.protocol.identity import RobotId
from crcolony.protocol.local_link import CHALLENGE_BYTES
from crcolony.transport.inbox import Inbox
from crcolony.transport.local_socket import PAGE_NUMBER, is_of_this_user, listen_for_robots
from crcolony.transport.shared_rows import RowPage, SharedPages

_MAX_UNPROVED = 128
"""Connections that have not proved yet which robot they are; the oldest makes room."""


@dataclass(frozen=True)
class LocalRobotsUser:
    """What a process does with the robots on its machine."""

    verify: Callable[[bytes, bytes], tuple[RobotId, int, bytes]]
    """Returns, of a challenge and a proof, the robot, its slot, and what proves to it that this is its body; raises
    WireError"""
    on_open: Callable[[RobotId], None]
    """Is called with a robot whose link has been opened, and which may have missed an observation"""
    on_actions: Callable[[], None]
    """Is called when robots have acted"""


@dataclass(frozen=True)
class _Robot:
    """A robot on this machine; its connection ends with it."""

    connection: socket.socket
    slot: int
    page: RowPage
    bell: int
    """The descriptor of the eventfd that tells it of a new observation"""


class LocalRobots:
    """Accepts the robots of this machine, of the same user, that prove to have a body in this run of an arena.

    Raises OSError where there are no such sockets, or no such memory.
    """

    def __init__(self, arena_run: int, slots: int, inbox: Inbox, user: LocalRobotsUser) -> None:
        self._inbox, self._user = inbox, user
        self._robots: dict[RobotId, _Robot] = {}
        self._unproved: dict[int, tuple[socket.socket, bytes]] = {}
        """Connections and their challenges, by descriptor"""
        self._memory = SharedPages(slots)
        self._listening = listen_for_robots(arena_run)
        self._bell = _new_bell()
        """Robots ring it when they have acted"""
        weakref.finalize(self, os.close, self._bell)
        inbox.watch(self._listening.fileno(), self._accept)
        inbox.watch(self._bell, user.on_actions, is_bell=True)

    def __contains__(self, robot: RobotId) -> bool:
        return robot in self._robots

    def __len__(self) -> int:
        return len(self._robots)

    @property
    def pages(self) -> Pages:
        """The memory with the rows of all of them."""
        return self._memory.arrays

    def take_actions(self) -> Iterator[tuple[RobotId, int, FloatArray]]:
        """Yield robot, tick and row (ACTION_WIDTH,) of every action since the last call, one by one."""
        taken = self._memory.arrays.taken
        for robot, there in self._robots.items():
            action = there.page.read_action(int(taken[there.slot]))
            if action is not None:
                taken[there.slot] = action[0]
                yield robot, *action

    def publish_observation(
        self, robot: RobotId, tick: int, row: FloatArray, contact: Contact | None
    ) -> None:
        """Give a robot on this machine the observation of a tick."""
        self._robots[robot].page.write_observation(tick, row, contact)
        os.eventfd_write(self._robots[robot].bell, 1)

    def ring_all(self) -> None:
        """Tell all robots that there is a new observation on their page."""
        for robot in self._robots.values():
            os.eventfd_write(robot.bell, 1)

    def remove(self, robot: RobotId) -> None:
        """End the link to a robot, if there is one: it has no body any more."""
        there = self._robots.pop(robot, None)
        if there is not None:
            self._memory.end(there.slot)
            self._inbox.forget(there.connection.fileno())
            there.connection.close()
            os.close(there.bell)

    def close(self) -> None:
        """End all links; robots go on over the network."""
        self._inbox.forget(self._listening.fileno())
        self._listening.close()
        for robot in list(self._robots):
            self.remove(robot)
        for descriptor in list(self._unproved):
            self._drop(descriptor)
        self._inbox.forget(self._bell)
        self._memory.close()

    def _accept(self) -> None:
        try:
            connection, _ = self._listening.accept()
        except (
            OSError
        ):  # it has gone again, or too many files are open: that robot uses the network
            return
        connection.setblocking(False)
        challenge = secrets.token_bytes(CHALLENGE_BYTES)
        with contextlib.suppress(OSError):
            if is_of_this_user(connection):
                connection.send(challenge)
                descriptor = connection.fileno()
                self._inbox.watch(descriptor, lambda: self._open(descriptor))
                self._unproved[descriptor] = connection, challenge
                if len(self._unproved) > _MAX_UNPROVED:
                    self._drop(next(iter(self._unproved)))
                return
        connection.close()

    def _drop(self, descriptor: int) -> None:
        connection, _ = self._unproved.pop(descriptor)
        self._inbox.forget(descriptor)
        connection.close()

    def _open(self, descriptor: int) -> None:
        """Handle what a connection sends as its proof."""
        connection, challenge = self._unproved[descriptor]
        try:
            data = connection.recv(MAX_BODY_MESSAGE_BYTES)
            robot, slot, proof = self._user.verify(challenge, data)
            bell = _new_bell()
        except (WireError, OSError):
            self._drop(descriptor)
            return
        del self._unproved[descriptor]
        self._inbox.forget(descriptor)
        self.remove(robot)  # an earlier connection of a process that was restarted
        there = _Robot(connection, slot, self._memory.begin(slot), bell)
        self._robots[robot] = there
        self._inbox.watch(descriptor, lambda: self._end(robot, there))
        try:
            number = PAGE_NUMBER.pack(self.pages.page_of[slot])
            descriptors = [self._memory.descriptor, bell, self._bell]
            socket.send_fds(connection, [proof, number], descriptors)
        except OSError:
            self.remove(robot)
        else:
            self._user.on_open(robot)

    def _end(self, robot: RobotId, there: _Robot) -> None:
        """The robot's process has ended, or closed the link: it has nothing to say over the connection."""
        if self._robots.get(robot) is there:
            self.remove(robot)


def _new_bell() -> int:
    return os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
