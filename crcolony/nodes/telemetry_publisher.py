"""What a robot sends to observers: its state, its events, and replies about its history and its settings."""

import itertools
from collections import Counter
from collections.abc import Callable, Iterable

from crcolony.nodes.event_buffer import EventBuffer
from crcolony.nodes.node_inputs import ColonyMember, NodeResources
from crcolony.protocol.codec import WireError, encode
from crcolony.protocol.identity import RobotId
from crcolony.protocol.signed_telemetry import purpose_of_robot, sign_telemetry
from crcolony.protocol.telemetry_messages import (
    MAX_ACTIVITY_CHARACTERS,
    MAX_REPORTED_PEERS,
    MAX_SCHEMA,
    Activity,
    Fault,
    RobotEvent,
    RobotMetadata,
    RobotState,
    decode_history_request,
)
from crcolony.rate_limit import TokenBucket
from crcolony.transport.interface import TelemetryTopic

_MAX_FAULTS_PER_S = 10.0
"""Fault events that peers can make a robot publish."""
_MAX_REPLIES_PER_S = 100.0
"""Replies to observers, about history and metadata together."""
_MAX_FAULT_CHARACTERS = 500


class TelemetryPublisher:
    """The telemetry of one incarnation of a robot, whose genes `schema` names."""

    def __init__(self, member: ColonyMember, schema: str, resources: NodeResources) -> None:
        self.settings = "{}"
        """The robot's body, learning, life and heredity settings, as a JSON object"""
        self.faults: Counter[str] = Counter()
        """Faults of the outside, by kind"""
        self._states = 0
        """Published in this incarnation"""
        self._member, self._robot = member, member.identity.id
        self._schema = schema if len(schema) <= MAX_SCHEMA else ""
        self._transport, self._unix_s = resources.transport, resources.unix_s
        self._on_event = resources.on_event
        self._events = EventBuffer(self._robot, member.incarnation, resources.history_bytes)
        self._fault_limit = TokenBucket(_MAX_FAULTS_PER_S)
        self._reply_limit = TokenBucket(_MAX_REPLIES_PER_S)

    @property
    def seq(self) -> int:
        """Sequence number of the last event."""
        return self._events.seq

    @property
    def unix_ms(self) -> int:
        """Time of day (ms since 1970), never negative."""
        return max(0, int(1000.0 * self._unix_s()))

    def publish_event(self, event: RobotEvent) -> None:
        """Number an event, keep it for observers that miss it, and publish it."""
        self._on_event(event)
        self._publish("event", self._events.append(event, self.unix_ms))

    def publish_state(self, state: RobotState) -> None:
        """Publish the state of the robot."""
        self._states += 1
        self._publish("state", encode(state), (self._member.incarnation << 32) + self._states)

    def publish_activity(self, doing: str) -> None:
        """Publish what the robot does while it has no body."""
        activity = Activity(self.unix_ms, doing[:MAX_ACTIVITY_CHARACTERS], 0, 0)
        self._publish("activity", encode(activity))

    def report_fault(self, tick: int, what: str) -> None:
        """Count a fault of the outside by the text before its first colon, and publish it unless there are too many."""
        self.faults[what.partition(":")[0]] += 1
        if self._fault_limit.allow(self._unix_s()):
            self.publish_event(Fault(tick, what[:_MAX_FAULT_CHARACTERS]))

    def reply_history(self, tick: int, request: bytes, reply: Callable[[bytes], None]) -> None:
        """Reply with the events that an observer asks for; count malformed and excessive requests as faults."""
        try:
            history_request = decode_history_request(request)
        except WireError as error:
            self.report_fault(tick, f"malformed query: {error}")
            return
        if self._may_reply(tick):
            reply(self._sign(encode(self._events.reply_to(history_request))))

    def reply_metadata(
        self,
        tick: int,
        request: bytes,
        reply: Callable[[bytes], None],
        peers: Iterable[RobotId],
    ) -> None:
        """Reply with the robot's settings and some of its peers, within the same limits."""
        if request:
            self.report_fault(tick, "malformed query: it is not empty")
        elif self._may_reply(tick):
            reported = list(itertools.islice(peers, MAX_REPORTED_PEERS))
            incarnation = self._member.incarnation
            metadata = RobotMetadata(
                self._robot, incarnation, self.settings, reported, self._schema
            )
            reply(self._sign(encode(metadata)))

    def _publish(self, topic: TelemetryTopic, message: bytes, count: int = 0) -> None:
        self._transport.publish_telemetry(self._robot, topic, self._sign(message, count))

    def _sign(self, message: bytes, count: int = 0) -> bytes:
        member = self._member
        return sign_telemetry(message, purpose_of_robot(member.colony), member.identity, count)

    def _may_reply(self, tick: int) -> bool:
        may_reply = self._reply_limit.allow(self._unix_s())
        if not may_reply:
            self.report_fault(tick, "malformed query: too many queries")
        return may_reply
