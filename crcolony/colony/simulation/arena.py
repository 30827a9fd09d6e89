"""The process of an arena in virtual time, as `processes/arena.py` runs it by the clock, and its restarts."""

from collections.abc import Callable
from random import Random
from typing import Any

from crcolony.colony.arena_node import ArenaNode
from crcolony.colony.identity import RobotId
from crcolony.colony.messages import Leave, WireError, decode_action, decode_join, encode
from crcolony.colony.simulation.network import ARENA, Schedule, SimulatedNetwork
from crcolony.colony.transport import (
    Acted,
    ArenaGone,
    ArenaSeen,
    Arrival,
    Asked,
    Observed,
    RobotGone,
    RobotSeen,
)
from crcolony.config import Config

_SAVE_TICKS, _GRACE_S = 25, 4.0


class SimulatedArena:
    """Nature. After a crash it goes on from its last checkpoint, or begins anew: robots are told by `world`."""

    is_paused = False

    def __init__(
        self, config: Config, schedule: Schedule, network: SimulatedNetwork, rng: Random
    ) -> None:
        self.node: ArenaNode | None = None
        self.ticks = 0
        """In all its lives"""
        self._config, self._schedule, self._network, self._rng = config, schedule, network, rng
        self._is_closed = False
        self._checkpoint: dict[str, Any] | None = None
        self._sessions: dict[RobotId, set[str]] = {}

    def start(self) -> None:
        """Begin a run of the arena, unless one is under way."""
        if self.node is not None or self._is_closed:
            return
        world = self._rng.getrandbits(61)
        self.node = node = ArenaNode(self._config, world, False, body_grace_s=_GRACE_S)
        if self._checkpoint is not None and self._rng.random() < 0.7:
            node.restore(self._checkpoint)
            for robot in node.robots:
                node.lose(robot, self._schedule.now_s)
        self._sessions = {}
        self._network.host(ARENA, self, ArenaSeen(world), ArenaGone(world))
        self._schedule.after(self._config.arena.control_period_s, lambda: self._tick(node))

    def crash(self, says_goodbye: bool = True) -> None:
        """End at once."""
        self.node = None
        self._network.unhost(ARENA, says_goodbye)

    def close(self) -> None:
        """Let the world stand still for ever."""
        self.crash()
        self._is_closed = True

    def _tick(self, node: ArenaNode) -> None:
        if node is not self.node:
            return
        self._schedule.after(self._config.arena.control_period_s, lambda: self._tick(node))
        node.advance()
        self.ticks += 1
        for robot in node.robots:
            self._network.post((ARENA, robot), Observed(robot, node.observation(robot)))
        node.forget_lost(self._schedule.now_s)
        if node.tick % _SAVE_TICKS == 0:
            self._checkpoint = node.save()

    def deliver(self, arrival: Arrival) -> None:
        """Take what has arrived."""
        node = self.node
        assert node is not None, "only a running arena is reached"
        match arrival:
            case Acted(robot=robot, action=data):
                node.act(robot, decode_action(data))
            case Asked(about="join", question=question, answer=answer):
                self._admit(node, question, answer)
            case RobotSeen(robot=robot, session=session):
                self._sessions.setdefault(robot, set()).add(session)
                node.find(robot)
            case RobotGone(robot=robot, session=session):
                sessions = self._sessions.get(robot, set())
                sessions.discard(session)
                if not sessions:
                    node.lose(robot, self._schedule.now_s)

    def _admit(self, node: ArenaNode, question: bytes, answer: Callable[[bytes], None]) -> None:
        try:
            request = decode_join(question)
        except WireError:
            return
        if isinstance(request, Leave):
            node.leave(request.robot)
        else:
            answer(encode(node.join(request)))
