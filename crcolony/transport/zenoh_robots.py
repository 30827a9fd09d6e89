"""The robots' side of the network over Zenoh."""

from collections.abc import Callable
from typing import Any, Literal

import zenoh

from crcolony.protocol import key_expressions
from crcolony.protocol.codec import MAX_BODY_MESSAGE_BYTES, MAX_ENVELOPE_BYTES, MAX_SCENE_BYTES
from crcolony.protocol.identity import RobotId
from crcolony.protocol.key_expressions import ArenaKeys, ColonyKeys
from crcolony.transport.interface import (
    ArenaOffline,
    ArenaOnline,
    Deliver,
    EnvelopeReceived,
    IncompatiblePeer,
    JoinReplyReceived,
    ObservationReceived,
    QueryReceived,
    SceneReceived,
)
from crcolony.transport.liveliness_check import LivelinessCheck
from crcolony.transport.zenoh_samples import (
    _answer_to,
    _content,
    _listen,
    _payload,
    _presence,
    _publisher,
)

_JOIN_TIMEOUT_S = 1.0

_MAX_GONE = 10_000


class RobotTransport:
    """The robots of this process on Zenoh, all of one colony, with their bodies in one arena."""

    def __init__(self, session: zenoh.Session, colony: str, arena: str, deliver: Deliver) -> None:
        self._colony, self._arena = ColonyKeys(colony), ArenaKeys(arena)
        self._deliver = deliver
        self._publishers: dict[str, zenoh.Publisher] = {}
        self._incarnations: dict[RobotId, int] = {}
        self._declared: dict[RobotId, list[Any]] = {}
        self._is_searching = False
        self._gone: set[str] = set()
        """Sessions whose token has gone: Zenoh may keep the link of one that is closed, and that is nobody"""
        self._begin(session)

    def _begin(self, session: zenoh.Session) -> None:
        self.name = str(session.zid())
        self._session = session
        self._check = LivelinessCheck(session)
        self._watches = [
            session.liveliness().declare_subscriber(
                self._colony.all_alive, _listen(self._on_robot), history=True
            ),
            session.liveliness().declare_subscriber(
                self._colony.all_versions, _listen(self._on_version), history=True
            ),
            session.liveliness().declare_subscriber(
                self._arena.all_alive, _listen(self._on_arena), history=True
            ),
            session.declare_subscriber(self._arena.scene, _listen(self._on_scene)),
        ]

    def reconnect(self, reopen: Callable[[], zenoh.Session]) -> None:
        """Leave the session for another, with all robots; the old one is closed first, since it holds the port."""
        for (
            robot
        ) in self._incarnations:  # a session that closes was seen to tell of its tokens once more
            self._withdraw(robot)
        self.close()
        self._publishers.clear()
        self._begin(reopen())
        for robot, incarnation in self._incarnations.items():
            self.add_robot(robot, incarnation)

    def close(self) -> None:
        """Leave the network."""
        self._session.close()  # type: ignore[no-untyped-call]

    def peers_without_token(self, now_s: float) -> list[str]:
        """Return peers that have been connected for long, and whose robots cannot be seen."""
        return [peer for peer in self._check.find_missing(now_s) if peer not in self._gone]

    def add_robot(self, robot: RobotId, incarnation: int) -> None:
        """Let a robot be reached, and then be seen."""
        deliver = self._deliver
        self._incarnations[robot] = incarnation

        def on_past(query: zenoh.Query) -> None:
            deliver(QueryReceived("history", robot, _payload(query), _answer_to(query)))

        def on_about(query: zenoh.Query) -> None:
            deliver(QueryReceived("metadata", robot, _payload(query), _answer_to(query)))

        self._declared[robot] = [
            self._session.declare_subscriber(
                self._colony.inbox(robot),
                _listen(
                    lambda s: deliver(
                        EnvelopeReceived(robot, _content(s.payload, MAX_ENVELOPE_BYTES))
                    )
                ),
            ),
            self._session.declare_subscriber(
                self._arena.observation(robot),
                _listen(
                    lambda s: deliver(
                        ObservationReceived(robot, _content(s.payload, MAX_BODY_MESSAGE_BYTES))
                    )
                ),
            ),
            self._session.declare_queryable(self._colony.history(robot), _listen(on_past)),
            self._session.declare_queryable(self._colony.metadata(robot), _listen(on_about)),
            self._session.liveliness().declare_token(
                self._colony.alive(robot, incarnation, self.name)
            ),
        ]

    def remove_robot(self, robot: RobotId) -> None:
        """Let a robot be gone."""
        self._incarnations.pop(robot, None)
        self._withdraw(robot)

    def _withdraw(self, robot: RobotId) -> None:
        for entity in reversed(self._declared.pop(robot, [])):
            entity.undeclare()

    def send_envelope(self, to: RobotId, envelope: bytes) -> None:
        """Post a letter."""
        self._publish(self._colony.inbox(to), envelope)

    def request_body(self, robot: RobotId, request: bytes) -> None:
        """Ask the arena for a body."""
        deliver = self._deliver

        def on_reply(reply: zenoh.Reply) -> None:
            if reply.ok is not None:
                deliver(
                    JoinReplyReceived(robot, _content(reply.ok.payload, MAX_BODY_MESSAGE_BYTES))
                )

        self._session.get(
            self._arena.join,
            _listen(on_reply),
            payload=request,
            timeout=_JOIN_TIMEOUT_S,
            consolidation=zenoh.ConsolidationMode.NONE,
        )

    def publish_action(self, robot: RobotId, action: bytes) -> None:
        """Command a body."""
        self._publish(self._arena.action(robot), action)

    def publish_telemetry(
        self, robot: RobotId, topic: Literal["state", "event"], data: bytes
    ) -> None:
        """Publish telemetry."""
        key = self._colony.state(robot) if topic == "state" else self._colony.event(robot)
        self._publish(key, data)

    def subscribe_scene(self, is_searching: bool) -> None:
        """Let what the arena shows arrive, or not."""
        self._is_searching = is_searching

    def _publish(self, key: str, data: bytes) -> None:
        publisher = self._publishers.get(key)
        if publisher is None:
            publisher = self._publishers[key] = _publisher(self._session, key)
        publisher.put(data)

    def _on_robot(self, sample: zenoh.Sample) -> None:
        token = key_expressions.parse_robot_token(str(sample.key_expr))
        if token is None:
            return
        if sample.kind == zenoh.SampleKind.PUT:
            self._gone.discard(token.session)
        elif len(self._gone) < _MAX_GONE:
            self._gone.add(token.session)
        self._deliver(_presence(sample, token))

    def _on_version(self, sample: zenoh.Sample) -> None:
        stranger = key_expressions.parse_incompatible_peer(str(sample.key_expr))
        if stranger is not None and sample.kind == zenoh.SampleKind.PUT:
            self._deliver(IncompatiblePeer(*stranger))

    def _on_scene(self, sample: zenoh.Sample) -> None:
        if self._is_searching:
            self._deliver(SceneReceived(_content(sample.payload, MAX_SCENE_BYTES)))

    def _on_arena(self, sample: zenoh.Sample) -> None:
        token = key_expressions.parse_arena_token(str(sample.key_expr))
        if token is not None:
            kind = ArenaOnline if sample.kind == zenoh.SampleKind.PUT else ArenaOffline
            self._deliver(kind(token.arena_run))
