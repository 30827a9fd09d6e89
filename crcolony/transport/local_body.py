"""The link of a robot to its body on the same machine (Linux): a page of memory, and two doorbells."""

import contextlib
import os
import socket
import time

from crcolony.body.shared_pages import Page
from crcolony.compiled import FloatArray
from crcolony.protocol.body_messages import LocalLink
from crcolony.protocol.codec import MAX_BODY_MESSAGE_BYTES, WireError
from crcolony.protocol.identity import RobotId
from crcolony.protocol.link_keys import LinkKeys
from crcolony.protocol.local_link import CHALLENGE_BYTES, check_body, prove_robot
from crcolony.transport.inbox import Inbox
from crcolony.transport.local_socket import PAGE_NUMBER, connect_to_arena
from crcolony.transport.shared_rows import RowPage, map_page

_DESCRIPTORS = 3
"""The memory, the robot's doorbell, and the arena's"""


class LocalBody:
    """Opens the link when the body's process is on this machine and of the same user; see `LinkOnThisMachine`."""

    def __init__(self, inbox: Inbox) -> None:
        self._inbox = inbox
        self._connection: socket.socket | None = None
        self._page: RowPage | None = None
        self._bells: list[int] = []
        """The robot's, and the arena's"""
        self._link = LocalLink(b"", 0, b"")
        self._keys = LinkKeys(b"", b"")

    @property
    def is_open(self) -> bool:
        """See `LinkOnThisMachine`."""
        return self._page is not None

    def open(self, robot: RobotId, arena_run: int, keys: LinkKeys) -> None:
        """See `LinkOnThisMachine`."""
        if self.is_open and self._link.arena_run == arena_run:
            return
        self.close()
        self._connection = connect_to_arena(arena_run)
        if self._connection is not None:
            self._link, self._keys = LocalLink(robot, arena_run, b""), keys
            self._inbox.watch(self._connection.fileno(), self._receive)

    @property
    def page(self) -> Page | None:
        """See `LinkOnThisMachine`."""
        return self._page.arrays if self._page is not None else None

    def ring(self) -> None:
        """See `LinkOnThisMachine`."""
        os.eventfd_write(self._bells[1], 1)

    def publish_action(self, tick: int, row: FloatArray) -> None:
        """See `LinkOnThisMachine`."""
        assert self._page is not None
        self._page.write_action(tick, row)
        self.ring()

    def wait_for_quiet(self, until_s: float) -> float | None:
        """Wait until the body's process rings, and return the time then; None if anything else happens before.

        What that is waits in the inbox then, with the latest observation.
        """
        if self._page is None:
            return None
        is_quiet = self._inbox.wait_for_bell(self._bells[0], until_s - time.monotonic())
        return time.monotonic() if is_quiet else None

    def observe(self) -> None:
        """Put the latest observation into the inbox."""
        observation = self._page.read_observation() if self._page is not None else None
        if observation is not None:
            self._inbox.put_urgent(observation)

    def close(self) -> None:
        """End the link; rows go over the network."""
        if self._connection is None:
            return
        self._inbox.forget(self._connection.fileno())
        self._connection.close()
        self._connection = None
        if self._page is not None:
            self._page = None
            self._inbox.forget(self._bells[0])
        for bell in self._bells:
            os.close(bell)
        self._bells = []

    def _receive(self) -> None:
        """Handle what the body's process sends: a challenge, then its proof, and at last an end."""
        assert self._connection is not None
        try:
            data, descriptors, _, _ = socket.recv_fds(
                self._connection, MAX_BODY_MESSAGE_BYTES, _DESCRIPTORS, socket.MSG_CMSG_CLOEXEC
            )
            if self.is_open or not data:
                _close_all(descriptors)
            elif not self._link.challenge:
                _close_all(descriptors)
                self._answer(data)
                return
            elif self._take(data, descriptors):
                return
        except OSError:
            pass
        self.close()

    def _answer(self, challenge: bytes) -> None:
        if len(challenge) != CHALLENGE_BYTES:
            raise OSError("not a challenge")
        assert self._connection is not None
        self._link = LocalLink(self._link.robot, self._link.arena_run, challenge)
        self._connection.send(prove_robot(self._link, self._keys))

    def _take(self, data: bytes, descriptors: list[int]) -> bool:
        """Use the page of a process that has the keys of the link; return whether it is such a process."""
        try:
            check_body(data[: -PAGE_NUMBER.size], self._link, self._keys)
            (number,) = PAGE_NUMBER.unpack(data[-PAGE_NUMBER.size :])
            memory, own_bell, arena_bell = descriptors
            page = map_page(memory, number)
            self._inbox.watch(own_bell, self.observe, is_bell=True)
        except (WireError, OSError, ValueError):
            _close_all(descriptors)
            return False
        os.close(memory)
        self._page, self._bells = page, [own_bell, arena_bell]
        self.observe()  # what was published before
        return True


def _close_all(descriptors: list[int]) -> None:
    for descriptor in descriptors:
        with contextlib.suppress(OSError):
            os.close(descriptor)
