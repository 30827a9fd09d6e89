"""The robots of a host process: each is a peer with its own id, key, storage and matings; all step as one batch."""

from collections.abc import Sequence

import numpy as np

from crcolony.body import contract
from crcolony.nodes.arena_node import ArenaNode
from crcolony.nodes.node_inputs import STATE_PERIOD_S
from crcolony.nodes.robot_node import RobotNode
from crcolony.protocol.body_messages import Contact
from crcolony.protocol.identity import RobotId
from crcolony.robot.state import Robots, StepParameters
from crcolony.robot.step import step_robots
from crcolony.transport.interface import (
    EnvelopeReceived,
    InboundEvent,
    QueryReceived,
    RobotOffline,
    RobotOnline,
)
from crcolony.transport.zenoh_robots import RobotTransport

_SNAPSHOT_S = 10.0
"""How often each robot is saved, unless there are too many of them."""
_MIN_SAVE_PERIOD_S = 0.5
"""The shortest time between the snapshots of two robots of the process."""


class HostedRobots:
    """Robots with the first slots of an arena in the same process. `batch` holds a row of state for each."""

    def __init__(
        self,
        nodes: Sequence[RobotNode],
        batch: Robots,
        parameters: StepParameters,
        transport: RobotTransport,
    ) -> None:
        self.nodes = nodes
        self._by_id = {node.id: node for node in nodes}
        self._batch, self._parameters, self._transport = batch, parameters, transport
        self._actions = np.zeros((len(nodes), contract.ACTION_WIDTH))
        self._save_period_s = max(_SNAPSHOT_S / len(nodes), _MIN_SAVE_PERIOD_S)
        self._state_due_s = self._save_due_s = 0.0
        self._last_saved = 0

    def __contains__(self, robot: RobotId) -> bool:
        return robot in self._by_id

    def start(self, now_s: float, arena: ArenaNode, arena_name: str, settings: str) -> None:
        """Start all robots and give them bodies; `settings` are the JSON that each reports.

        Raises CrcolonyError if stored robots do not fit.
        """
        for slot, node in enumerate(self.nodes):
            node.start(now_s)
            arena.join(node.id, node.colony, slot)
            node.arena, node.telemetry.settings = arena_name, settings
            self._transport.add_robot(node.id, node.incarnation)
        self._state_due_s, self._save_due_s = now_s, now_s + self._save_period_s

    def set_revoked(self, robots: frozenset[RobotId]) -> None:
        """Let no robot mate any more with those that are revoked."""
        for node in self.nodes:
            node.set_revoked(robots)

    def stop(self) -> None:
        """Save all robots, and disconnect them."""
        for node in self.nodes:
            node.save()
            self._transport.remove_robot(node.id)

    def set_actions(self, arena: ArenaNode) -> None:
        """Set the actions of the robots' bodies for the next tick."""
        for slot, action in enumerate(self._actions):
            arena.set_action(slot, action)

    def step(self, now_s: float, arena: ArenaNode) -> None:
        """Make one control step of all robots on the observations of this tick, and handle their events."""
        observations = arena.arena.world.observations[-1, : len(self.nodes)]
        if not step_robots(self._batch, self._parameters, observations, self._actions):
            return
        for row in np.flatnonzero(self._batch.events).tolist():
            node, contact = self.nodes[row], _contact_in(observations[row], arena)
            node.handle_step_events(now_s, arena.tick, contact)
            node.advance_slice()

    def handle_event(self, now_s: float, event: InboundEvent) -> None:
        """Handle an inbound event."""
        match event:
            case EnvelopeReceived(to=to, envelope=envelope) if to in self._by_id:
                self._by_id[to].handle_envelope(now_s, envelope)
            case RobotOnline(robot=peer, incarnation=incarnation, session=session):
                for node in self.nodes:
                    node.handle_peer_online(now_s, peer, incarnation, session)
            case RobotOffline(robot=peer, incarnation=incarnation, session=session):
                for node in self.nodes:
                    node.handle_peer_offline(now_s, peer, incarnation, session)
            case QueryReceived(topic="history", robot=robot, payload=payload, reply=reply):
                self._by_id[robot].reply_history(payload, reply)
            case QueryReceived(topic="metadata", robot=robot, payload=payload, reply=reply):
                self._by_id[robot].reply_metadata(payload, reply)

    def handle_timers(self, now_s: float, dropped: int) -> None:
        """Handle timeouts, publish states and save, each when due; `dropped` counts discarded inbound events."""
        for node in self.nodes:
            if node.next_s <= now_s:
                node.handle_timeouts(now_s)
        if now_s >= self._state_due_s:
            self._state_due_s = now_s + STATE_PERIOD_S
            for node in self.nodes:
                node.publish_state(dropped)
        if now_s >= self._save_due_s:
            self._save_due_s = now_s + self._save_period_s
            self._last_saved = (self._last_saved + 1) % len(self.nodes)
            self.nodes[self._last_saved].save()


def _contact_in(observation: np.ndarray, arena: ArenaNode) -> Contact | None:
    if observation[contract.ENCOUNTER] == 0.0:
        return None
    partner = arena.occupant(int(observation[contract.ENCOUNTER_ROBOT]))
    return Contact(partner, int(observation[contract.ENCOUNTER_NONCE])) if partner else None
