"""What arrives for bodies: requests and actions of robots, and queries of observers. No clock, no threads.

The processes of arenas and bridges run it by the clock of their machine, and the fault simulation in virtual time.
"""

import secrets
from collections.abc import Callable, Iterable
from functools import partial

from crcolony.body_server.body_links import BodyLinks, StaleRequestError
from crcolony.body_server.body_slots import BodySlots, NoBodyError
from crcolony.protocol.body_messages import Join, decode_action
from crcolony.protocol.body_requests import Request
from crcolony.protocol.codec import Message, WireError, encode
from crcolony.protocol.identity import Identity, RobotId
from crcolony.protocol.signed_telemetry import purpose_of_arena, sign_telemetry
from crcolony.protocol.token_set import TokenTable
from crcolony.rate_limit import TokenBucket
from crcolony.transport.interface import (
    ActionReceived,
    InboundEvent,
    NoRobotsOnThisMachine,
    QueryReceived,
    RobotOffline,
    RobotOnline,
    RobotsOnThisMachine,
)

_MAX_LINES_PER_S = 100.0
"""Lines that peers can make it print."""
_MAX_REPLIES_PER_S = 100.0
"""Replies to metadata queries."""
_MAX_DENIED = 1000
"""Robots that were denied a body and are remembered, so that each is printed once."""


class BodyServer:
    """Carries out what arrives for the bodies of an arena or a bridge; `identity` is its key, `name` what it is called.

    `on_leave` receives every robot whose body is removed, `print_line` what a person should read.
    """

    def __init__(
        self,
        bodies: BodySlots,
        identity: Identity,
        on_leave: Callable[[RobotId], None] = lambda robot: None,
        print_line: Callable[[str], None] = lambda line: None,
        name: str = "arena",
        draw: Callable[[int], bytes] = secrets.token_bytes,
    ) -> None:
        self._bodies, self._on_leave, self._print_line, self._name = (
            bodies,
            on_leave,
            print_line,
            name,
        )
        self.local_robots: RobotsOnThisMachine = NoRobotsOnThisMachine()
        self._identity = identity
        self._links = BodyLinks(name, bodies.arena_run, identity, draw)
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
                self._handle_action(robot, data)
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

    def publish_observations(
        self, robots: Iterable[RobotId], publish: Callable[[RobotId, bytes], None]
    ) -> None:
        """Give these robots, which have bodies, what they sense in this tick: over the network with `publish`.

        A robot that has not asked in this run gets nothing.
        """
        bodies, local = self._bodies, self.local_robots
        for robot in robots:
            if robot in local:
                local.publish_observation(robot, bodies.tick, *bodies.sense(robot))
                continue
            observation = self._links.seal_observation(robot, bodies.observation(robot))
            if observation is not None:
                publish(robot, observation)

    def sign(self, message: Message) -> bytes:
        """Return what the arena tells all that listen, encoded and signed."""
        return sign_telemetry(encode(message), purpose_of_arena(self._name), self._identity)

    def prove_local(self, challenge: bytes, data: bytes) -> tuple[RobotId, int, bytes]:
        """Return which robot on this machine has a body here, in which slot, and the proof for it.

        Raises WireError if none has.
        """
        robot, proof = self._links.prove_local(challenge, data)
        slot = self._bodies.robots.get(robot)
        if slot is None:
            raise WireError("of a robot without a body")
        return robot, slot, proof

    def remove_absent(self, now_s: float) -> None:
        """Remove the bodies of robots that have been offline for too long."""
        for robot in self._bodies.remove_absent(now_s):
            self._print_line(f"robot {robot.hex()[:8]} did not return; its body is removed")
            self._links.remove(robot)
            self._end_links(robot)

    def _end_links(self, robot: RobotId) -> None:
        self.local_robots.remove(robot)
        self._on_leave(robot)

    def _handle_action(self, robot: RobotId, data: bytes) -> None:
        try:
            content = self._links.open_action(robot, data)
        except WireError:
            self._bodies.counts["forged"] += 1
            return
        try:
            self._bodies.apply_action(robot, decode_action(content))
        except WireError:
            self._bodies.counts["malformed"] += 1

    def _handle_join_query(
        self, now_s: float, robot: RobotId, payload: bytes, reply: Callable[[bytes], None]
    ) -> None:
        """Handle a query of `robot`: the network may let nobody else use its key, so its content must be its own."""
        try:
            request = self._links.receive(now_s, robot, payload)
            if isinstance(request, bytes):
                reply(request)
            elif request is None:
                self._bodies.counts["too many"] += 1
            elif isinstance(request.message, Join):
                self._handle_join(now_s, request, request.message, reply)
            else:
                self._handle_leave(now_s, request)
        except StaleRequestError:
            self._bodies.counts["stale"] += 1
        except WireError as error:
            self._bodies.counts["malformed"] += 1
            self._print_limited(now_s, f"malformed request for a body: {error}")

    def _reply_metadata(self, now_s: float, payload: bytes, reply: Callable[[bytes], None]) -> None:
        if payload:
            self._bodies.counts["malformed"] += 1
        elif self._reply_limit.allow(now_s):
            reply(self.sign(self._bodies.metadata(self._name)))
        else:
            self._bodies.counts["too many"] += 1

    def _handle_leave(self, now_s: float, request: Request) -> None:
        robot = request.message.robot
        self._links.leave(request)
        slot = self._bodies.robots.get(robot)
        if slot is not None:
            self._print_limited(now_s, f"robot {robot.hex()[:8]} leaves slot {slot}")
            self._bodies.leave(robot)
            self._end_links(robot)

    def _handle_join(
        self, now_s: float, request: Request, join: Join, reply: Callable[[bytes], None]
    ) -> None:
        bodies, robot = self._bodies, join.robot
        is_new = robot not in bodies.robots
        name = f"robot {robot.hex()[:8]} of colony {join.colony}"
        try:
            slot = bodies.join(robot, join.colony, join.slot)
        except NoBodyError as error:
            reply(self._links.deny(request, str(error)))
            if robot not in self._denied:
                self._denied[robot] = None
                self._print_limited(now_s, f"{name} gets no slot: {error}")
                if len(self._denied) > _MAX_DENIED:
                    self._denied.clear()
            return
        reply(self._links.grant(request, partial(bodies.grant, slot)))
        if robot not in self._online:
            bodies.mark_offline(robot, now_s)  # until its liveliness token arrives
        if is_new:
            self._print_limited(now_s, f"{name} gets slot {bodies.robots[robot]}")

    def _print_limited(self, now_s: float, line: str) -> None:
        """Print a line that any peer can cause, within the rate limit."""
        if self._line_limit.allow(now_s):
            self._print_line(line)
