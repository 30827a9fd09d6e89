"""The arena's side of the transport over Zenoh."""

from collections.abc import Callable
from typing import Any

import zenoh

from crcolony.protocol import key_expressions
from crcolony.protocol.codec import MAX_BODY_MESSAGE_BYTES
from crcolony.protocol.identity import Identity, RobotId
from crcolony.protocol.key_expressions import ArenaKeys
from crcolony.protocol.signed_telemetry import purpose_of_arena, sign_telemetry
from crcolony.transport.interface import ActionReceived, Deliver, QueryReceived
from crcolony.transport.liveliness_follower import LivelinessFollower
from crcolony.transport.zenoh_samples import (
    callback,
    declare_publisher,
    leaving,
    payload_bytes,
    presence_event,
    query_bytes,
    reply_once,
)


def activity_of_arena(
    session: zenoh.Session, arena: str, identity: Identity
) -> Callable[[bytes], None]:
    """Return a function that signs and publishes what an arena does before it is online."""
    publisher = declare_publisher(session, ArenaKeys(arena).activity)
    purpose = purpose_of_arena(arena)
    return lambda activity: publisher.put(sign_telemetry(activity, purpose, identity))


class ArenaTransport:
    """An arena on Zenoh: it receives join queries and actions, and publishes observations and scenes."""

    def __init__(
        self, session: zenoh.Session, arena: str, arena_run: int, deliver: Deliver
    ) -> None:
        self._keys, self._arena_run = ArenaKeys(arena), arena_run
        self._deliver = deliver
        self._robots = LivelinessFollower(session, key_expressions.ALL_ROBOTS_ALIVE, self._on_robot)
        self._declare(session)

    def _declare(self, session: zenoh.Session) -> None:
        self._session = session
        self._publishers: dict[RobotId, zenoh.Publisher] = {}
        self._scene = declare_publisher(session, self._keys.scene)
        live = session.liveliness()
        self._entities: list[Any] = [
            session.declare_subscriber(self._keys.all_actions, callback(self._on_action)),
            session.declare_queryable(self._keys.all_joins, callback(self._on_join)),
            session.declare_queryable(self._keys.metadata, callback(self._on_metadata)),
            live.declare_token(self._keys.alive(self._arena_run, str(session.zid()))),
        ]

    def move_to(self, session: zenoh.Session) -> Callable[[], None]:
        """Serve the bodies in another session; return a function that undeclares them in the former one."""
        former = self._entities
        self._declare(session)
        return leaving(former, self._robots.move_to(session))

    def publish_observation(self, robot: RobotId, observation: bytes) -> None:
        """Publish the observation of a robot's body."""
        publisher = self._publishers.get(robot)
        if publisher is None:
            key = self._keys.observation(robot)
            publisher = self._publishers[robot] = declare_publisher(self._session, key)
        publisher.put(observation)

    def remove_robot(self, robot: RobotId) -> None:
        """Undeclare the publisher of a robot that has left."""
        publisher = self._publishers.pop(robot, None)
        if publisher is not None:
            publisher.undeclare()  # type: ignore[no-untyped-call]

    def publish_scene(self, scene: bytes) -> None:
        """Publish the scene."""
        self._scene.put(scene)

    def _on_action(self, sample: zenoh.Sample) -> None:
        robot = key_expressions.parse_body_topic(str(sample.key_expr), "action")
        if robot is not None:
            self._deliver(
                ActionReceived(robot, payload_bytes(sample.payload, MAX_BODY_MESSAGE_BYTES))
            )

    def _on_join(self, query: zenoh.Query) -> None:
        robot = key_expressions.parse_body_topic(str(query.key_expr), "join")
        if robot is not None:
            self._deliver(QueryReceived("join", robot, query_bytes(query), reply_once(query)))

    def _on_metadata(self, query: zenoh.Query) -> None:
        reply = reply_once(query, self._keys.metadata)
        self._deliver(QueryReceived("metadata", b"", query_bytes(query), reply))

    def _on_robot(self, key: str, is_online: bool) -> None:
        token = key_expressions.parse_robot_token(key)
        if token is not None:
            self._deliver(presence_event(token, is_online))
