"""The process of a bridge: every control period it publishes what attached robots measure, and it forwards actions.

Where two robots meet that no network connects, the envelopes of their mating go by infrared: the bridge of each stands
in for the other one.
"""

import time
from collections.abc import Callable

from crcolony.body_server.body_server import BodyServer
from crcolony.protocol.identity import Identity
from crcolony.runtime.local_robots import accept_local_robots
from crcolony.runtime.real_time_loop import run_in_real_time
from crcolony.transport.connection import Connection
from crcolony.transport.inbox import Inbox
from crcolony.transport.interface import (
    EnvelopeReceived,
    InboundEvent,
    RobotOffline,
    RobotOnline,
)
from crcolony.transport.zenoh_arena import ArenaTransport
from crcolony.transport.zenoh_relay import EnvelopeRelay
from crcolony_bridge.attached_bodies import AttachedBodies
from crcolony_bridge.infrared.relay import AbsentRobots, parties_of

_REMOVAL_PERIOD_S = 0.5
"""How often the bodies of absent robots are removed."""


class BridgeProcess:
    """Serves attached robots under an arena's keys; `name` is that arena's name, `identity` the key."""

    def __init__(
        self,
        bodies: AttachedBodies,
        name: str,
        identity: Identity,
        transport: ArenaTransport,
        relay: EnvelopeRelay,
        inbox: Inbox,
        connection: Connection,
        print_line: Callable[[str], None],
    ) -> None:
        self._bodies, self._transport, self._inbox = bodies, transport, inbox
        self._server = BodyServer(bodies, identity, transport.remove_robot, print_line, name)
        self._relay, self._connection = relay, connection
        self._absent = AbsentRobots(self._server.online)
        self._removal_due_s = 0.0

    def run(self, is_stopped: Callable[[], bool], period_s: float) -> None:
        """Run until stopped."""
        server = self._server
        accept_local_robots(server, self._bodies, self._inbox, self._transport.publish_observation)
        try:
            run_in_real_time(self, self._inbox, period_s, is_stopped)
        finally:
            server.local_robots.close()

    def handle_event(self, event: InboundEvent) -> None:
        """Handle an inbound event."""
        match event:
            case RobotOnline(session=session) | RobotOffline(session=session) if (
                session == self._relay.name
            ):
                pass  # a token of our own
            case EnvelopeReceived(envelope=envelope):
                parties = parties_of(envelope)
                if parties is not None:
                    now_s = time.monotonic()
                    self._bodies.send_by_infrared(now_s, parties.sender, envelope)
            case _:
                self._server.handle_event(time.monotonic(), event)

    def handle_timers(self, now_s: float) -> None:
        """Remove absent robots, and look after the connection, when that is due."""
        self._connection.handle_timers(now_s)
        if now_s >= self._removal_due_s:
            self._removal_due_s = now_s + _REMOVAL_PERIOD_S
            self._server.remove_absent(now_s)

    def step(self) -> None:
        """Begin a control period, and publish the observations of bodies that have measured something."""
        now_s = time.monotonic()
        robots = self._bodies.step(now_s, self._server.online)
        self._server.publish_observations(robots, self._transport.publish_observation)
        for receiver, message in self._bodies.received:
            colony = self._bodies.colony_of(receiver)
            self._absent.receive(now_s, message.robot, colony)
            if message.envelope and parties_of(message.envelope) == (message.robot, receiver):
                self._relay.put(colony, receiver, message.envelope)
        self._relay.stand_in_for(self._absent.update(now_s, self._bodies.robots.__contains__))
