"""The robots' side of the transport over Zenoh."""

import itertools
from collections.abc import Callable
from typing import Any

import zenoh

from crcolony.protocol import key_expressions
from crcolony.protocol.codec import MAX_BODY_MESSAGE_BYTES, MAX_ENVELOPE_BYTES, MAX_SCENE_BYTES
from crcolony.protocol.identity import RobotId
from crcolony.protocol.key_expressions import ArenaKeys, ArenaToken, ColonyKeys
from crcolony.transport.interface import (
    ArenaMetadataReceived,
    ArenaOffline,
    ArenaOnline,
    Deliver,
    EnvelopeReceived,
    IncompatiblePeer,
    JoinReplyReceived,
    ObservationReceived,
    QueryReceived,
    SceneReceived,
    TelemetryTopic,
)
from crcolony.transport.liveliness_check import LivelinessCheck
from crcolony.transport.liveliness_follower import LivelinessFollower
from crcolony.transport.zenoh_samples import (
    callback,
    declare_publisher,
    leaving,
    payload_bytes,
    presence_event,
    query_bytes,
    reply_once,
    undeclare_all,
)

_JOIN_TIMEOUT_S = 1.0
_MAX_GONE = 10_000
"""Sessions remembered after their token has gone."""


class RobotTransport:
    """The robots of this process on Zenoh, all of one colony, with their bodies in one arena."""

    def __init__(self, session: zenoh.Session, colony: str, arena: str, deliver: Deliver) -> None:
        self._colony, self._arena = ColonyKeys(colony), ArenaKeys(arena)
        self._deliver = deliver
        self._publishers: dict[str, zenoh.Publisher] = {}
        self._arena_tokens: set[ArenaToken] = set()
        self._incarnations: dict[RobotId, int] = {}
        self._declared: dict[RobotId, list[Any]] = {}
        self._is_scene_needed = False
        self._gone: set[str] = set()
        """Sessions whose token has gone: Zenoh may keep the link of one that is closed"""
        self._followers = [
            LivelinessFollower(session, self._colony.all_alive, self._on_robot),
            LivelinessFollower(session, self._arena.all_alive, self._on_arena),
        ]
        self._declare(session)

    def _declare(self, session: zenoh.Session) -> None:
        self.name = str(session.zid())
        self._session = session
        self._check = LivelinessCheck(session)
        self._subscribers = [
            session.liveliness().declare_subscriber(
                self._colony.all_versions, callback(self._on_version), history=True
            ),
            session.declare_subscriber(self._arena.scene, callback(self._on_scene)),
        ]

    def move_to(self, session: zenoh.Session) -> Callable[[], None]:
        """Declare all robots in another session; return a function that undeclares them in the former one."""
        former = [*self._subscribers, *itertools.chain(*self._declared.values())]
        self._publishers = {}
        self._declare(session)
        for robot, incarnation in self._incarnations.items():
            self.add_robot(robot, incarnation)
        return leaving(former, *(follower.move_to(session) for follower in self._followers))

    def leave(self) -> None:
        """Undeclare all robots before the session is closed, which was observed to deliver its own tokens again."""
        undeclare_all(itertools.chain(*self._declared.values()))
        self._declared.clear()

    def peers_without_token(self, now_s: float) -> list[str]:
        """Return the sessions of peers that have been connected for long and have no liveliness token, each once."""
        return [peer for peer in self._check.find_missing(now_s) if peer not in self._gone]

    def add_robot(self, robot: RobotId, incarnation: int) -> None:
        """Declare a robot's subscribers and queryables, and then its liveliness token."""
        deliver = self._deliver
        history, metadata = self._colony.history(robot), self._colony.metadata(robot)
        self._incarnations[robot] = incarnation

        def on_history(query: zenoh.Query) -> None:
            deliver(QueryReceived("history", robot, query_bytes(query), reply_once(query, history)))

        def on_metadata(query: zenoh.Query) -> None:
            reply = reply_once(query, metadata)
            deliver(QueryReceived("metadata", robot, query_bytes(query), reply))

        self._declared[robot] = [
            self._session.declare_subscriber(
                self._colony.inbox(robot),
                callback(
                    lambda s: deliver(
                        EnvelopeReceived(robot, payload_bytes(s.payload, MAX_ENVELOPE_BYTES))
                    )
                ),
            ),
            self._session.declare_subscriber(
                self._arena.observation(robot),
                callback(
                    lambda s: deliver(
                        ObservationReceived(robot, payload_bytes(s.payload, MAX_BODY_MESSAGE_BYTES))
                    )
                ),
            ),
            self._session.declare_queryable(history, callback(on_history)),
            self._session.declare_queryable(metadata, callback(on_metadata)),
            self._session.liveliness().declare_token(
                self._colony.alive(robot, incarnation, self.name)
            ),
        ]

    def remove_robot(self, robot: RobotId) -> None:
        """Undeclare a robot, its liveliness token first."""
        self._incarnations.pop(robot, None)
        undeclare_all(self._declared.pop(robot, []))

    def send_envelope(self, to: RobotId, envelope: bytes) -> None:
        """Send an envelope."""
        self._session.put(
            self._colony.inbox(to),
            envelope,
            congestion_control=zenoh.CongestionControl.DROP,
            express=True,
        )

    def request_body(self, robot: RobotId, request: bytes) -> None:
        """Send the arena a request to join or leave."""
        deliver = self._deliver

        def on_reply(reply: zenoh.Reply) -> None:
            if reply.ok is not None:
                deliver(
                    JoinReplyReceived(
                        robot, payload_bytes(reply.ok.payload, MAX_BODY_MESSAGE_BYTES)
                    )
                )

        self._session.get(
            self._arena.join(robot),
            callback(on_reply),
            payload=request,
            timeout=_JOIN_TIMEOUT_S,
            consolidation=zenoh.ConsolidationMode.NONE,
        )

    def request_arena_metadata(self) -> None:
        """Request the arena's settings."""
        deliver = self._deliver

        def on_reply(reply: zenoh.Reply) -> None:
            if reply.ok is not None:
                deliver(ArenaMetadataReceived(payload_bytes(reply.ok.payload, MAX_ENVELOPE_BYTES)))

        self._session.get(
            self._arena.metadata,
            callback(on_reply),
            timeout=_JOIN_TIMEOUT_S,
            consolidation=zenoh.ConsolidationMode.NONE,
        )

    def publish_action(self, robot: RobotId, action: bytes) -> None:
        """Publish an action."""
        self._publish(self._arena.action(robot), action)

    def publish_telemetry(self, robot: RobotId, topic: TelemetryTopic, data: bytes) -> None:
        """Publish telemetry."""
        keys = self._colony
        key_of = {"state": keys.state, "event": keys.event, "activity": keys.activity}
        self._publish(key_of[topic](robot), data)

    def subscribe_scene(self, is_needed: bool) -> None:
        """Deliver the arena's scenes while they are needed."""
        self._is_scene_needed = is_needed

    def _publish(self, key: str, data: bytes) -> None:
        publisher = self._publishers.get(key)
        if publisher is None:
            publisher = self._publishers[key] = declare_publisher(self._session, key)
        publisher.put(data)

    def _on_robot(self, key: str, is_online: bool) -> None:
        token = key_expressions.parse_robot_token(key)
        if token is None:
            return
        if is_online:
            self._gone.discard(token.session)
        elif len(self._gone) < _MAX_GONE:
            self._gone.add(token.session)
        self._deliver(presence_event(token, is_online))

    def _on_version(self, sample: zenoh.Sample) -> None:
        peer = key_expressions.parse_incompatible_peer(str(sample.key_expr))
        if peer is not None and sample.kind == zenoh.SampleKind.PUT:
            self._deliver(IncompatiblePeer(*peer))

    def _on_scene(self, sample: zenoh.Sample) -> None:
        if self._is_scene_needed:
            self._deliver(SceneReceived(payload_bytes(sample.payload, MAX_SCENE_BYTES)))

    def _on_arena(self, key: str, is_online: bool) -> None:
        """Deliver that an arena is offline when the last token of its run has gone: it may have changed its session."""
        token = key_expressions.parse_arena_token(key)
        if token is None:
            return
        if is_online:
            self._arena_tokens.add(token)
            self._deliver(ArenaOnline(token.arena_run))
        else:
            self._arena_tokens.discard(token)
            if not any(token.arena_run == other.arena_run for other in self._arena_tokens):
                self._deliver(ArenaOffline(token.arena_run))
