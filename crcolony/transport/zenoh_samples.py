"""What the two Zenoh transports share: publishers, callbacks, and how samples and queries become inbound events.

Callbacks run on Zenoh's threads and do one thing: enqueue. Everything is a `put` that is dropped when a link is
congested, so that a frozen peer blocks no other: what must not be lost is retried until it is answered (matings,
lockstep), and a lost observation is followed by a new one. A robot's liveliness token is declared last, when the robot
can be reached.
"""

import contextlib
import threading
from collections.abc import Callable, Iterable
from typing import Any

import zenoh
from zenoh.handlers import Callback

from crcolony.protocol import key_expressions
from crcolony.protocol.codec import MAX_BODY_MESSAGE_BYTES
from crcolony.transport.interface import (
    RobotOffline,
    RobotOnline,
)


def callback(handler: Callable[[Any], None]) -> Any:
    """Return a Zenoh callback that runs `handler` on the thread that receives."""
    return Callback(handler, indirect=False)


def declare_publisher(session: zenoh.Session, key: str) -> zenoh.Publisher:
    """Return a publisher that drops samples when the link is congested, and never batches them."""
    return session.declare_publisher(
        key, congestion_control=zenoh.CongestionControl.DROP, express=True
    )


def undeclare_all(entities: Iterable[Any]) -> None:
    """Undeclare what a session has, the last first; one that is closed, or out of reach, has nothing any more."""
    for entity in reversed(list(entities)):
        with contextlib.suppress(zenoh.ZError):
            entity.undeclare()


def leaving(entities: Iterable[Any], *others: Callable[[], None]) -> Callable[[], None]:
    """Return a function that undeclares what a former session has, then calls the others: the end of a `move_to`."""

    def leave() -> None:
        undeclare_all(entities)
        for other in others:
            other()

    return leave


def presence_event(
    token: key_expressions.RobotToken, is_online: bool
) -> RobotOnline | RobotOffline:
    """Return the inbound event of a robot's liveliness token that appeared or went."""
    kind = RobotOnline if is_online else RobotOffline
    return kind(token.robot, token.incarnation, token.session)


def query_bytes(query: zenoh.Query) -> bytes:
    """Return the payload of a query; empty if it has none, or one that is too long."""
    return (
        payload_bytes(query.payload, MAX_BODY_MESSAGE_BYTES) if query.payload is not None else b""
    )


def payload_bytes(payload: zenoh.ZBytes, max_bytes: int) -> bytes:
    """Return a payload; empty, which is no valid message, if it is longer than `max_bytes`."""
    return payload.to_bytes() if len(payload) <= max_bytes else b""


def reply_once(query: zenoh.Query, key: str | None = None) -> Callable[[bytes], None]:
    """Return a function that replies to a query, once, from any thread.

    `key` is the key of the reply: of replies under one key, a query to several keeps only the last. None: the query's.
    """
    once = threading.Lock()

    def reply(data: bytes) -> None:
        if once.acquire(blocking=False):
            query.reply(key or query.key_expr, data)
            query.drop()  # type: ignore[no-untyped-call]

    return reply
