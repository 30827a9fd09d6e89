"""What arrives for bodies: requests and actions of robots, and queries of observers. No clock, no threads.

The processes of arenas and bridges run it by the clock of their machine, and the fault simulation in virtual time.
"""

from collections.abc import Callable

from crcolony.body_server.body_slots import BodySlots
from crcolony.protocol.body_messages import BodyDenied, Join, Leave, decode_action, decode_join
from crcolony.protocol.codec import WireError, encode
from crcolony.protocol.identity import RobotId
from crcolony.protocol.token_set import TokenTable
from crcolony.rate_limit import TokenBucket
from crcolony.transport.interface import (
    ActionReceived,
    InboundEvent,
    QueryReceived,
    RobotOffline,
    RobotOnline,
)

_MAX_LINES_PER_S = 100.0
"""Lines that peers can make it print."""
_MAX_REPLIES_PER_S = 100.0
"""Replies to metadata queries."""
_MAX_DENIED = 1000
"""Robots that were denied a body and are remembered, so that each is printed once."""


class BodyServer:
    """Carries out what arrives for the bodies of an arena or a bridge; `name` is its name for robots and observers.

    `on_leave` receives every robot whose body is removed, `print_line` what a person should read.
    """

    def __init__(
        self,
        bodies: BodySlots,
        on_leave: Callable[[RobotId], None] = lambda robot: None,
        print_line: Callable[[str], None] = lambda line: None,
        name: str = "arena",
    ) -> None:
        self._bodies, self._on_leave, self._print_line, self._name = (
            bodies,
            on_leave,
            print_line,
            name,
        )
        self._line_limit = TokenBucket(_MAX_LINES_PER_S)
        self._reply_limit = TokenBucket(_MAX_REPLIES_PER_S)
        self._denied: dict[RobotId, None] = {}
        self._online = TokenTable()

    @property
    def online(self) -> TokenTable:
        """The robots that are online, with their tokens."""
        return self._online

    def handle_event(self, now_s: float, event: InboundEvent) -> None:
        """Handle an inbound event."""
        match event:
            case ActionReceived(robot=robot, action=data):
                try:
                    self._bodies.apply_action(robot, decode_action(data))
                except WireError:
                    self._bodies.counts["malformed"] += 1
            case QueryReceived(topic="join", robot=robot, payload=payload, reply=reply):
                self._handle_join_query(now_s, robot, payload, reply)
            case QueryReceived(topic="metadata", payload=payload, reply=reply):
                self._reply_metadata(now_s, payload, reply)
            case RobotOnline(robot=robot, incarnation=incarnation, session=session):
                self._online.add(robot, (incarnation, session))
                self._bodies.mark_online(robot)
            case RobotOffline(robot=robot, incarnation=incarnation, session=session):
                if self._online.remove(robot, (incarnation, session)):
                    self._bodies.mark_offline(robot, now_s)

    def remove_absent(self, now_s: float) -> None:
        """Remove the bodies of robots that have been offline for too long."""
        for robot in self._bodies.remove_absent(now_s):
            self._print_line(f"robot {robot.hex()[:8]} did not return; its body is removed")
            self._on_leave(robot)

    def _handle_join_query(
        self, now_s: float, robot: RobotId, payload: bytes, reply: Callable[[bytes], None]
    ) -> None:
        """Handle a query of `robot`: the network may let nobody else use its key, so its content must be its own."""
        try:
            request = decode_join(payload)
            if request.robot != robot:
                raise WireError("under the key of another robot")
        except WireError as error:
            self._bodies.counts["malformed"] += 1
            self._print_limited(now_s, f"malformed request for a body: {error}")
            return
        if isinstance(request, Leave):
            self._handle_leave(now_s, request.robot)
        else:
            self._handle_join(now_s, request, reply)

    def _reply_metadata(self, now_s: float, payload: bytes, reply: Callable[[bytes], None]) -> None:
        if payload:
            self._bodies.counts["malformed"] += 1
        elif self._reply_limit.allow(now_s):
            reply(encode(self._bodies.metadata(self._name)))
        else:
            self._bodies.counts["too many"] += 1

    def _handle_leave(self, now_s: float, robot: RobotId) -> None:
        slot = self._bodies.robots.get(robot)
        if slot is not None:
            self._print_limited(now_s, f"robot {robot.hex()[:8]} leaves slot {slot}")
            self._bodies.leave(robot)
            self._on_leave(robot)

    def _handle_join(self, now_s: float, request: Join, reply: Callable[[bytes], None]) -> None:
        bodies, robot = self._bodies, request.robot
        is_new = robot not in bodies.robots
        answer = bodies.join(request)
        reply(encode(answer))
        name = f"robot {robot.hex()[:8]} of colony {request.colony}"
        if isinstance(answer, BodyDenied):
            if robot not in self._denied:
                self._denied[robot] = None
                self._print_limited(now_s, f"{name} gets no slot: {answer.reason}")
                if len(self._denied) > _MAX_DENIED:
                    self._denied.clear()
            return
        if robot not in self._online:
            bodies.mark_offline(robot, now_s)  # until its liveliness token arrives
        if is_new:
            self._print_limited(now_s, f"{name} gets slot {bodies.robots[robot]}")

    def _print_limited(self, now_s: float, line: str) -> None:
        """Print a line that any peer can cause, within the rate limit."""
        if self._line_limit.allow(now_s):
            self._print_line(line)
