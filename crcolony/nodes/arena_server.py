"""Where robots are received in an arena: what they say and do becomes what happens there. No clock, no threads.

`processes/arena.py` runs it by the clock of this machine, and `simulation/` in virtual time.
"""

from collections.abc import Callable

from crcolony.nodes.arena_node import ArenaNode
from crcolony.protocol.body_messages import BodyDenied, Join, Leave, decode_action, decode_join
from crcolony.protocol.codec import WireError, encode
from crcolony.protocol.identity import RobotId
from crcolony.rate_limit import TokenBucket
from crcolony.transport.interface import (
    ActionReceived,
    InboundEvent,
    QueryReceived,
    RobotOffline,
    RobotOnline,
)

_LINES_PER_S, _ANSWERS_PER_S = 100.0, 100.0
"""What strangers can make an arena say, at most"""
_MAX_REFUSED = 1000


class ArenaServer:
    """Carries out in an arena what arrives for it. `forget` hears who has left; `say` tells a person.

    `name` is what observers are told that the arena is called.
    """

    def __init__(
        self,
        node: ArenaNode,
        forget: Callable[[RobotId], None] = lambda robot: None,
        print_line: Callable[[str], None] = lambda line: None,
        name: str = "arena",
    ) -> None:
        self._node, self._forget, self._print_line, self._name = node, forget, print_line, name
        self._lines, self._answered = TokenBucket(_LINES_PER_S), TokenBucket(_ANSWERS_PER_S)
        self._refused: dict[RobotId, None] = {}
        """Who was told, so that it is said once"""
        self._sessions: dict[RobotId, set[str]] = {}
        """Where every robot is on the network"""

    def handle_event(self, now_s: float, event: InboundEvent) -> None:
        """See to what has arrived."""
        match event:
            case ActionReceived(robot=robot, action=data):
                try:
                    self._node.apply_action(robot, decode_action(data))
                except WireError:
                    self._node.counts["malformed"] += 1
            case QueryReceived(topic="join", payload=payload, reply=reply):
                self._answer(now_s, payload, reply)
            case QueryReceived(topic="metadata", payload=payload, reply=reply):
                self._answer_about(now_s, payload, reply)
            case RobotOnline(robot=robot, session=session):
                self._sessions.setdefault(robot, set()).add(session)
                self._node.mark_online(robot)
            case RobotOffline(robot=robot, session=session):
                sessions = self._sessions.get(robot, set())
                sessions.discard(session)
                if not sessions:
                    self._sessions.pop(robot, None)
                    self._node.mark_offline(robot, now_s)

    def remove_absent(self, now_s: float) -> None:
        """Take the bodies away of all who have been gone for too long."""
        for robot in self._node.remove_absent(now_s):
            self._print_line(f"robot {robot.hex()[:8]} did not come back; its body is removed")
            self._forget(robot)

    def _answer(self, now_s: float, payload: bytes, answer: Callable[[bytes], None]) -> None:
        try:
            request = decode_join(payload)
        except WireError as error:
            self._node.counts["malformed"] += 1
            self._say_of_strangers(now_s, f"malformed request for a body: {error}")
            return
        if isinstance(request, Leave):
            self._dismiss(now_s, request.robot)
        else:
            self._admit(now_s, request, answer)

    def _answer_about(self, now_s: float, payload: bytes, answer: Callable[[bytes], None]) -> None:
        if payload:
            self._node.counts["malformed"] += 1
        elif self._answered.allow(now_s):
            answer(encode(self._node.metadata(self._name)))
        else:
            self._node.counts["too many"] += 1

    def _dismiss(self, now_s: float, robot: RobotId) -> None:
        slot = self._node.robots.get(robot)
        if slot is not None:
            self._say_of_strangers(now_s, f"robot {robot.hex()[:8]} leaves place {slot}")
            self._node.leave(robot)
            self._forget(robot)

    def _admit(self, now_s: float, request: Join, answer: Callable[[bytes], None]) -> None:
        node, robot = self._node, request.robot
        is_new = robot not in node.robots
        reply = node.join(request)
        answer(encode(reply))
        name = f"robot {robot.hex()[:8]} of colony {request.colony}"
        if isinstance(reply, BodyDenied):
            if robot not in self._refused:
                self._refused[robot] = None
                self._say_of_strangers(now_s, f"{name} gets no place: {reply.reason}")
                if len(self._refused) > _MAX_REFUSED:
                    self._refused.clear()
            return
        if robot not in self._sessions:
            node.mark_offline(robot, now_s)  # until it is on the network
        if is_new:
            self._say_of_strangers(now_s, f"{name} gets place {node.robots[robot]}")

    def _say_of_strangers(self, now_s: float, line: str) -> None:
        """Say what anybody can make an arena say, but not without end."""
        if self._lines.allow(now_s):
            self._print_line(line)
