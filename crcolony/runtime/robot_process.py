"""The process of one robot: inbound events and the clock of this machine drive an `EmbodiedRobot`."""

import functools
import time
from collections.abc import Callable

from crcolony.nodes.embodied_robot import EmbodiedRobot
from crcolony.nodes.node_inputs import EmbodimentOptions, ProcessCallbacks
from crcolony.nodes.robot_node import RobotNode
from crcolony.runtime.console import print_warning
from crcolony.transport.connection import Connection
from crcolony.transport.inbox import Inbox
from crcolony.transport.interface import NetworkError, NoLinkOnThisMachine
from crcolony.transport.local_body import LocalBody
from crcolony.transport.local_socket import HAS_LOCAL_LINKS
from crcolony.transport.zenoh_robots import RobotTransport

_MAX_WAIT_S = 0.5
"""The longest wait for an event, so that a shutdown is noticed, and the time between two attempts to connect."""

_MAX_QUIET_S = 0.05
"""The longest time for which nothing but observations is handled: other timers are due now and then."""


class RobotProcess:
    """Runs one robot until it is stopped, or has completed the last generation.

    With `shares_memory` it shares memory with its body if that is on this machine.
    """

    def __init__(
        self,
        node: RobotNode,
        transport: RobotTransport,
        inbox: Inbox,
        options: EmbodimentOptions,
        connection: Connection,
        print_line: Callable[[str], None],
        shares_memory: bool = True,
    ) -> None:
        self._node, self._transport, self._inbox = node, transport, inbox
        self._connection, self._print_line = connection, print_line
        self._is_stopped: Callable[[], bool] = lambda: False
        self._local = LocalBody(inbox) if HAS_LOCAL_LINKS and shares_memory else None
        callbacks = ProcessCallbacks(
            self._reconnect,
            print_line,
            lambda: inbox.dropped,
            print_warning,
            self._local or NoLinkOnThisMachine(),
        )
        self._robot = EmbodiedRobot(node, transport, options, callbacks)

    def run(self, is_stopped: Callable[[], bool]) -> None:
        """Run, and save at the end. Raises DuplicateIdentityError, StorageError and FatalStorageError."""
        self._is_stopped = is_stopped
        node, robot = self._node, self._robot
        node.peers.session = self._transport.name
        robot.start(time.monotonic())
        self._connection.on_roster(lambda roster: node.set_revoked(roster.revoked_robots))
        self._transport.add_robot(node.id, node.incarnation)
        try:
            while not is_stopped() and not robot.is_done:
                self._answer_quietly()
                wait_s = min(robot.next_s - time.monotonic(), _MAX_WAIT_S)
                event = self._inbox.get(max(wait_s, 0.0))
                if event is not None:
                    robot.handle_event(time.monotonic(), event)
                self._handle_timers(time.monotonic())
        finally:
            robot.release_body()
            if self._local is not None:
                self._local.close()
            self._transport.remove_robot(node.id)
        node.save()

    def _answer_quietly(self) -> None:
        """Answer observations of a body on this machine until anything else happens, or is due."""
        local, robot = self._local, self._robot
        if local is None:
            return
        until_s = min(robot.next_s, time.monotonic() + _MAX_QUIET_S)
        wait = functools.partial(local.wait_for_quiet, until_s)
        while self._inbox.is_empty and robot.can_answer_quietly and time.monotonic() < until_s:
            if not robot.answer_quietly(wait):
                local.observe()

    def _handle_timers(self, now_s: float) -> None:
        self._connection.handle_timers(now_s)
        self._node.peers.session = self._transport.name
        self._robot.handle_timers(now_s)
        for peer in self._transport.peers_without_token(now_s):
            self._robot.report_fault(
                f"peer {peer} has no token: another program, or a robot whose token was lost"
            )

    def _reconnect(self) -> None:
        """Close the session and open another; retry until that succeeds or the process is stopped."""
        printed = ""
        while not self._is_stopped():
            try:
                self._transport.leave()
                self._connection.reopen()
            except NetworkError as error:  # a router that is offline at the moment
                if str(error) != printed:
                    printed = str(error)
                    self._print_line(f"waiting for the network: {error}")
                self._inbox.get(_MAX_WAIT_S)
            else:
                self._node.peers.session = self._transport.name
                return
