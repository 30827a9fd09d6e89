"""The process of one robot: what arrives from the network and the clock of this machine drive an `EmbodiedRobot`."""

import time
from collections.abc import Callable

import zenoh

from crcolony.colony import telemetry
from crcolony.colony.embodied_robot import EmbodiedRobot
from crcolony.colony.inbox import Inbox
from crcolony.colony.node import RobotNode
from crcolony.colony.telemetry import Ended, Exchanged
from crcolony.colony.transport import NetworkError
from crcolony.colony.zenoh_transport import RobotTransport
from crcolony.config import Config

_LONGEST_WAIT_S = 0.5


class RobotProcess:
    """Runs one robot until it is told to stop, or has lived through the last generation of the config."""

    def __init__(
        self,
        node: RobotNode,
        transport: RobotTransport,
        inbox: Inbox,
        config: Config,
        arena: str,
        wanted_place: int,
        snapshot_s: float,
        reopen: Callable[[], zenoh.Session],
        say: Callable[[str], None],
    ) -> None:
        self._node, self._transport, self._inbox = node, transport, inbox
        self._reopen, self._say = reopen, say
        self._is_stopped: Callable[[], bool] = lambda: False
        self._robot = EmbodiedRobot(
            node, transport, config, arena, wanted_place, snapshot_s, self._come_anew, say,
            lambda: inbox.dropped,
        )  # fmt: skip

    def run(self, is_stopped: Callable[[], bool]) -> None:
        """Live; everything is saved in the end. Raises TwinError, StoreError and StoreBroken."""
        self._is_stopped = is_stopped
        node, robot = self._node, self._robot
        node.session = self._transport.name
        robot.begin(time.monotonic())
        self._transport.host(node.id, node.life)
        try:
            while not is_stopped() and not robot.is_done:
                wait_s = min(robot.next_s - time.monotonic(), _LONGEST_WAIT_S)
                arrival = self._inbox.get(max(wait_s, 0.0))
                if arrival is not None:
                    robot.take(time.monotonic(), arrival)
                self._keep_time(time.monotonic())
        finally:
            robot.leave()
            self._transport.unhost(node.id)
        node.save()

    def _keep_time(self, now_s: float) -> None:
        self._robot.keep_time(now_s)
        for peer in self._transport.peers_without_token(now_s):
            self._robot.say_fault(
                f"peer {peer} has no token: a stranger, or a robot that is not seen"
            )

    def _come_anew(self) -> None:
        """Leave the network and come back, however long that takes."""
        while not self._is_stopped():
            try:
                self._transport.move(self._reopen)
            except NetworkError as error:  # a router that is away just now
                self._say(f"{error}; trying again")
                self._inbox.get(_LONGEST_WAIT_S)
            else:
                self._node.session = self._transport.name
                return


def in_words(event: telemetry.Event) -> str | None:
    """Return what an event means to a person, or None if it is too common to say."""
    match event:
        case Exchanged(partner=partner, conceived=conceived, energy=energy):
            what = "conceived" if conceived else "no offspring"
            return f"mated with {partner[:8]}…, {what} (energy {energy:.2f})"
        case Ended(outcome=outcome, peer=peer, reason=reason) if outcome != "mated":
            return f"mating with {peer.hex()[:8]}: {outcome} {reason}".rstrip()
    return None
