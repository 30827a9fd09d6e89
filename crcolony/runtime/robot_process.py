"""The process of one robot: what arrives from the network and the clock of this machine drive an `EmbodiedRobot`."""

import time
from collections.abc import Callable

import zenoh

from crcolony.config import Config
from crcolony.nodes.embodied_robot import EmbodiedRobot
from crcolony.nodes.robot_node import RobotNode
from crcolony.transport.inbox import Inbox
from crcolony.transport.interface import NetworkError
from crcolony.transport.zenoh_robots import RobotTransport

_MAX_WAIT_S = 0.5


class RobotProcess:
    """Runs one robot until it is told to stop, or has lived through the last generation of the config."""

    def __init__(
        self,
        node: RobotNode,
        transport: RobotTransport,
        inbox: Inbox,
        config: Config,
        arena: str,
        wanted_slot: int,
        snapshot_s: float,
        reopen: Callable[[], zenoh.Session],
        print_line: Callable[[str], None],
    ) -> None:
        self._node, self._transport, self._inbox = node, transport, inbox
        self._reopen, self._print_line = reopen, print_line
        self._is_stopped: Callable[[], bool] = lambda: False
        self._robot = EmbodiedRobot(
            node, transport, config, arena, wanted_slot, snapshot_s, self._reconnect_session, print_line,
            lambda: inbox.dropped,
        )  # fmt: skip

    def run(self, is_stopped: Callable[[], bool]) -> None:
        """Live; everything is saved in the end. Raises DuplicateIdentityError, StorageError and FatalStorageError."""
        self._is_stopped = is_stopped
        node, robot = self._node, self._robot
        node.session = self._transport.name
        robot.start(time.monotonic())
        self._transport.add_robot(node.id, node.incarnation)
        try:
            while not is_stopped() and not robot.is_done:
                wait_s = min(robot.next_s - time.monotonic(), _MAX_WAIT_S)
                event = self._inbox.get(max(wait_s, 0.0))
                if event is not None:
                    robot.handle_event(time.monotonic(), event)
                self._keep_time(time.monotonic())
        finally:
            robot.release_body()
            self._transport.remove_robot(node.id)
        node.save()

    def _keep_time(self, now_s: float) -> None:
        self._robot.handle_timers(now_s)
        for peer in self._transport.peers_without_token(now_s):
            self._robot.report_fault(
                f"peer {peer} has no token: a stranger, or a robot that is not seen"
            )

    def _reconnect_session(self) -> None:
        """Leave the network and come back, however long that takes."""
        while not self._is_stopped():
            try:
                self._transport.reconnect(self._reopen)
            except NetworkError as error:  # a router that is away just now
                self._print_line(f"{error}; trying again")
                self._inbox.get(_MAX_WAIT_S)
            else:
                self._node.session = self._transport.name
                return
