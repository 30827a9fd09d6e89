"""Zenoh behind the seam of `transport.py`. Its callbacks run on Zenoh's threads and do one thing: enqueue.

Everything is a `put` that gives way when a link is congested, so that a frozen peer stalls nobody: what must not be
lost is said again until it is answered (matings, lockstep), and a lost observation is followed by a fresh one.
Presence is a liveliness token, declared last, when the robot can be reached.
"""

import threading
from collections.abc import Callable
from typing import Any

import zenoh
from zenoh.handlers import Callback

from crcolony.protocol import key_expressions
from crcolony.protocol.codec import MAX_BODY_MESSAGE_BYTES
from crcolony.transport.interface import (
    RobotOffline,
    RobotOnline,
)


def _listen(handler: Callable[[Any], None]) -> Any:
    return Callback(handler, indirect=False)


def _publisher(session: zenoh.Session, key: str) -> zenoh.Publisher:
    return session.declare_publisher(
        key, congestion_control=zenoh.CongestionControl.DROP, express=True
    )


def _presence(
    sample: zenoh.Sample, token: key_expressions.RobotToken
) -> RobotOnline | RobotOffline:
    kind = RobotOnline if sample.kind == zenoh.SampleKind.PUT else RobotOffline
    return kind(token.robot, token.incarnation, token.session)


def _payload(query: zenoh.Query) -> bytes:
    return _content(query.payload, MAX_BODY_MESSAGE_BYTES) if query.payload is not None else b""


def _content(payload: zenoh.ZBytes, most: int) -> bytes:
    """Return what came in; of more than a message may be, nothing, which is no message either."""
    return payload.to_bytes() if len(payload) <= most else b""


def _answer_to(query: zenoh.Query) -> Callable[[bytes], None]:
    """Return what answers a query, once, from any thread."""
    once = threading.Lock()

    def answer(data: bytes) -> None:
        if once.acquire(blocking=False):
            query.reply(query.key_expr, data)
            query.drop()  # type: ignore[no-untyped-call]

    return answer
