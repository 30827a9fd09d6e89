"""The links of an arena to the robots on the same machine (Linux): one memory and one doorbell for each of them."""

import contextlib
import os
import secrets
import socket
import weakref
from collections.abc import Callable
from dataclasses import dataclass

from crcolony.compiled import FloatArray
from crcolony.protocol.body_messages import Contact
from crcolony.protocol.codec import MAX_BODY_MESSAGE_BYTES, WireError
from crcolony.protocol.identity import RobotId
from crcolony.protocol.local_link import CHALLENGE_BYTES
from crcolony.transport.inbox import Inbox
from crcolony.transport.local_socket import is_of_this_user, listen_for_robots
from crcolony.transport.shared_rows import SharedRows, create_shared_memory

_MAX_UNPROVED = 128
"""Connections that have not proved yet which robot they are; the oldest makes room."""

Verify = Callable[[bytes, bytes], tuple[RobotId, bytes]]
"""Returns, of a challenge and a proof, the robot and what proves to it that this is its body; raises WireError"""


@dataclass
class _Robot:
    """A robot on this machine; its connection ends with it."""

    connection: socket.socket
    rows: SharedRows
    bell: int
    """The descriptor of the eventfd that tells it of a new observation"""


class LocalRobots:
    """Accepts the robots of this machine, of the same user, that prove to have a body in this run of an arena.

    `on_open` is called with every robot whose link has been opened: its present observation is to be published again.
    """

    def __init__(
        self, arena_run: int, inbox: Inbox, verify: Verify, on_open: Callable[[RobotId], None]
    ) -> None:
        self._inbox, self._verify, self._on_open = inbox, verify, on_open
        self._robots: dict[RobotId, _Robot] = {}
        self._unproved: dict[int, tuple[socket.socket, bytes]] = {}
        """Connections and their challenges, by descriptor"""
        self._listening = listen_for_robots(arena_run)
        self._bell = _new_bell()
        """Robots ring it when they have acted"""
        weakref.finalize(self, os.close, self._bell)
        inbox.watch(self._listening.fileno(), self._accept)
        inbox.watch(self._bell, self._take_actions, is_bell=True)

    def __contains__(self, robot: RobotId) -> bool:
        return robot in self._robots

    def publish_observation(
        self, robot: RobotId, tick: int, row: FloatArray, contact: Contact | None
    ) -> None:
        """Give a robot on this machine the observation of a tick."""
        there = self._robots[robot]
        there.rows.publish_observation(tick, row, contact)
        os.eventfd_write(there.bell, 1)

    def remove(self, robot: RobotId) -> None:
        """End the link to a robot, if there is one: it has no body any more."""
        there = self._robots.pop(robot, None)
        if there is not None:
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

    def _take_actions(self) -> None:
        for robot, there in self._robots.items():
            action = there.rows.take_action(robot)
            if action is not None:
                self._inbox.put_urgent(action)

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
                self._unproved[descriptor] = connection, challenge
                self._inbox.watch(descriptor, lambda: self._open(descriptor))
                if len(self._unproved) > _MAX_UNPROVED:
                    self._drop(next(iter(self._unproved)))
                return
        connection.close()

    def _drop(self, descriptor: int) -> socket.socket:
        connection, _ = self._unproved.pop(descriptor)
        self._inbox.forget(descriptor)
        connection.close()
        return connection

    def _open(self, descriptor: int) -> None:
        """Handle what a connection sends as its proof."""
        connection, challenge = self._unproved[descriptor]
        try:
            robot, proof = self._verify(challenge, connection.recv(MAX_BODY_MESSAGE_BYTES))
            there = self._share_memory(connection, proof)
        except (WireError, OSError):
            self._drop(descriptor)
            return
        del self._unproved[descriptor]
        self._inbox.forget(descriptor)
        self.remove(robot)  # an earlier connection of a process that was restarted
        self._robots[robot] = there
        self._inbox.watch(descriptor, lambda: self._end(robot, there))
        self._on_open(robot)

    def _share_memory(self, connection: socket.socket, proof: bytes) -> _Robot:
        memory = create_shared_memory()
        try:
            bell = _new_bell()
            try:
                there = _Robot(connection, SharedRows(memory), bell)
                socket.send_fds(connection, [proof], [memory, bell, self._bell])
            except OSError:
                os.close(bell)
                raise
        finally:
            os.close(memory)
        return there

    def _end(self, robot: RobotId, there: _Robot) -> None:
        """The robot's process has ended, or closed the link: it has nothing to say over the connection."""
        if self._robots.get(robot) is there:
            self.remove(robot)


def _new_bell() -> int:
    return os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
