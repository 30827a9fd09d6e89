"""Subscribes to telemetry over Zenoh: for `crcolony top`, `status` and `launch`, and for dashboards."""

import time
from collections.abc import Callable
from typing import Any

import zenoh
from zenoh.handlers import Callback

from crcolony.protocol import key_expressions
from crcolony.protocol.codec import MAX_BODY_MESSAGE_BYTES, MAX_ENVELOPE_BYTES, MAX_SCENE_BYTES
from crcolony.protocol.key_expressions import ColonyKeys
from crcolony.protocol.signed_telemetry import TRAILER_BYTES
from crcolony.telemetry.backfill import REPLY_TIMEOUT_S, BackfillRequest
from crcolony.telemetry.colony_monitor import ColonyMonitor
from crcolony.telemetry.sample_verifier import SampleVerifier
from crcolony.telemetry.samples import RawSample, SampleKind, parse_sample
from crcolony.telemetry.status_changes import StatusChange
from crcolony.transport.bounded_queue import BoundedQueue
from crcolony.transport.liveliness_follower import LivelinessFollower
from crcolony.transport.zenoh_samples import leaving

_MAX_SAMPLES = 100_000
"""Samples that wait for `poll`; further ones are dropped and counted."""
_MAX_BYTES = 256 * 2**20
"""Bytes of their payloads."""
_TOKEN_LIMIT_FACTOR = 2.0
"""Liveliness tokens have more room in the queue than other samples: they are not repeated."""
_MAX_PAYLOAD_BYTES: dict[SampleKind, int] = {
    "state": MAX_BODY_MESSAGE_BYTES,
    "event": MAX_ENVELOPE_BYTES,
    "activity": MAX_BODY_MESSAGE_BYTES,
    "scene": MAX_SCENE_BYTES,
    "history": 2 * MAX_ENVELOPE_BYTES,
    "metadata": MAX_ENVELOPE_BYTES,
}
"""Without the signature. A longer payload is no message: it is replaced by an empty one, which nobody signed."""


class TelemetrySubscriber:
    """Subscribes to the telemetry of one colony, or of all; its `monitor` handles what has arrived at every `poll`.

    With `sends_requests` it requests missed events, the last `history` events before it subscribed, and metadata.
    `on_raw_sample` is called with every sample that is believed (`sample_verifier.py`), without its signature. Zenoh's
    threads only enqueue: samples are parsed and handled on the thread that calls `poll`.
    """

    def __init__(
        self,
        session: zenoh.Session,
        colony: str = "*",
        *,
        sends_requests: bool = False,
        history: int = 0,
        on_raw_sample: Callable[[RawSample], None] = lambda raw: None,
    ) -> None:
        self.monitor = ColonyMonitor(colony, history=history)
        self._keys, self._sends_requests = ColonyKeys(colony), sends_requests
        self._on_raw_sample = on_raw_sample
        self._verifier = SampleVerifier()
        self._queue = BoundedQueue[RawSample](_MAX_SAMPLES, _MAX_BYTES)
        self._followers = [
            LivelinessFollower(session, key, self._on_token)
            for key in (self._keys.all_alive, key_expressions.ALL_ARENAS_ALIVE)
        ]
        self._declare(session)

    def _declare(self, session: zenoh.Session) -> None:
        self._session, keys = session, self._keys
        liveliness = session.liveliness()
        self._entities: list[Any] = [
            liveliness.declare_token(key_expressions.observer(str(session.zid()))),
            session.declare_subscriber(keys.all_states, self._callback("state")),
            session.declare_subscriber(keys.all_events, self._callback("event")),
            session.declare_subscriber(keys.all_activities, self._callback("activity")),
            session.declare_subscriber(
                key_expressions.ALL_ARENA_ACTIVITIES, self._callback("activity")
            ),
            session.declare_subscriber(key_expressions.ALL_SCENES, self._callback("scene")),
        ]

    def move_to(self, session: zenoh.Session) -> Callable[[], None]:
        """Subscribe in another session; return a function that ends the subscriptions of the former one."""
        former = self._entities
        self._declare(session)
        return leaving(former, *(follower.move_to(session) for follower in self._followers))

    @property
    def dropped(self) -> int:
        """How many samples were dropped because too many waited, or too many were to be verified."""
        return self._queue.dropped + self._verifier.skipped

    @property
    def refused(self) -> int:
        """How many samples were refused since nobody signed them who may say this."""
        return self._verifier.refused

    def poll(self) -> list[StatusChange]:
        """Handle what has arrived since the last call, and send the requests that are due; return the changes."""
        changes: list[StatusChange] = []
        unix_s = time.time()
        for raw in self._verifier.open_all(time.monotonic(), self._queue.get_all()):
            self._on_raw_sample(raw)
            changes += self.monitor.handle_sample(parse_sample(raw))
        self.monitor.handle_timeouts(unix_s)
        if self._sends_requests:
            for request in self.monitor.due_requests(unix_s):
                self._send(request)
        return changes

    def _callback(self, kind: SampleKind) -> Any:
        return Callback(lambda sample: self._enqueue_sample(kind, sample), indirect=False)

    def _on_token(self, key: str, is_online: bool) -> None:
        self._enqueue("online" if is_online else "offline", key, b"", _TOKEN_LIMIT_FACTOR)

    def _send(self, request: BackfillRequest) -> None:
        """Send a request to all that reply to its key: one of them may be an impostor."""

        def on_reply(reply: zenoh.Reply) -> None:
            if reply.ok is not None:
                self._enqueue_sample(request.kind, reply.ok)

        self._session.get(
            request.key,
            Callback(on_reply, indirect=False),
            payload=request.payload,
            timeout=REPLY_TIMEOUT_S,
            target=zenoh.QueryTarget.ALL,
            consolidation=zenoh.ConsolidationMode.NONE,
        )

    def _enqueue_sample(self, kind: SampleKind, sample: zenoh.Sample) -> None:
        is_short = len(sample.payload) <= _MAX_PAYLOAD_BYTES[kind] + TRAILER_BYTES
        payload = sample.payload.to_bytes() if is_short else b""
        self._enqueue(kind, str(sample.key_expr), payload)

    def _enqueue(
        self, kind: SampleKind, key: str, payload: bytes, limit_factor: float = 1.0
    ) -> None:
        raw = RawSample(kind, key, payload, int(1000.0 * time.time()))
        self._queue.put(raw, len(payload), limit_factor)
