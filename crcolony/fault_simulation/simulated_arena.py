"""The process of an arena in virtual time, in place of `runtime.arena_process`, with its crashes and restarts."""

from random import Random
from typing import Any

from crcolony.body_server.body_server import BodyServer
from crcolony.config import Config
from crcolony.fault_simulation.simulated_network import ARENA, Schedule, SimulatedNetwork
from crcolony.nodes.arena_node import ArenaNode
from crcolony.protocol.identity import SEED_BYTES, Identity, RobotId
from crcolony.transport.interface import (
    ArenaOffline,
    ArenaOnline,
    InboundEvent,
    ObservationReceived,
    SceneReceived,
)

_SAVE_TICKS = 25
"""Ticks between two checkpoints."""
_GRACE_S = 4.0
"""How long the body of an absent robot stays."""


class SimulatedArena:
    """An arena that resumes from its last checkpoint after a crash, or starts empty, with another `arena_run`."""

    is_paused = False

    def __init__(
        self, config: Config, schedule: Schedule, network: SimulatedNetwork, rng: Random
    ) -> None:
        self.node: ArenaNode | None = None
        self.ticks = 0
        """In all its runs"""
        self._config, self._schedule, self._network, self._rng = config, schedule, network, rng
        self._identity = Identity(rng.randbytes(SEED_BYTES))
        self._is_closed = False
        self._checkpoint: dict[str, Any] | None = None

    def start(self) -> None:
        """Start a run of the arena, unless one is running."""
        if self.node is not None or self._is_closed:
            return
        arena_run = self._rng.getrandbits(61)
        self.node = node = ArenaNode(self._config, arena_run, False, body_grace_s=_GRACE_S)
        if self._checkpoint is not None and self._rng.random() < 0.7:
            node.restore(self._checkpoint)
            for robot in node.robots:
                node.mark_offline(robot, self._schedule.now_s)
        self._server = BodyServer(node, self._identity, draw=self._rng.randbytes)
        self._network.add_process(ARENA, self, ArenaOnline(arena_run), ArenaOffline(arena_run))
        self._schedule.after(self._config.arena.control_period_s, lambda: self._tick(node))

    def crash(self, closes_links: bool = True) -> None:
        """Stop at once; peers notice immediately if the links close, and else after their lease."""
        self.node = None
        self._network.remove_process(ARENA, closes_links)

    def close(self) -> None:
        """Stop the arena for good."""
        self.crash()
        self._is_closed = True

    def _tick(self, node: ArenaNode) -> None:
        if node is not self.node:
            return
        self._schedule.after(self._config.arena.control_period_s, lambda: self._tick(node))
        node.step()
        self.ticks += 1
        self._server.publish_observations(node.robots, self._publish_observation)
        if self._network.scene_subscribers:
            scene = self._server.sign(node.scene("arena", self.ticks, unix_ms=0))
            for robot in sorted(self._network.scene_subscribers):
                self._network.post((ARENA, robot), SceneReceived(scene))
        self._server.remove_absent(self._schedule.now_s)
        if node.tick % _SAVE_TICKS == 0:
            self._checkpoint = node.save()

    def _publish_observation(self, robot: RobotId, observation: bytes) -> None:
        self._network.post((ARENA, robot), ObservationReceived(robot, observation))

    def deliver(self, event: InboundEvent) -> None:
        """Handle an inbound event."""
        self._server.handle_event(self._schedule.now_s, event)
