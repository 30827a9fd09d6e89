"""A `ColonyMonitor` that is fed from the network; `crcolony top`, `status`, `launch` and dashboards see colonies through it."""

import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any

import zenoh
from zenoh.handlers import Callback

from crcolony.protocol import key_expressions
from crcolony.protocol.codec import MAX_BODY_MESSAGE_BYTES, MAX_ENVELOPE_BYTES, MAX_SCENE_BYTES
from crcolony.protocol.key_expressions import ColonyKeys
from crcolony.telemetry.backfill import ANSWER_S, BackfillRequest
from crcolony.telemetry.colony_monitor import ColonyMonitor, SampleKind, TelemetrySample
from crcolony.telemetry.status_changes import StatusChange

_MAX_WAITING, _MAX_BYTES = 100_000, 256 * 2**20
"""Of what was heard and waits for `update`; beyond it, it is dropped and counted."""
_LONGEST: dict[SampleKind, int] = {
    "state": MAX_BODY_MESSAGE_BYTES,
    "event": MAX_ENVELOPE_BYTES,
    "scene": MAX_SCENE_BYTES,
    "history": 2 * MAX_ENVELOPE_BYTES,
    "metadata": MAX_ENVELOPE_BYTES,
}
"""Bytes: of what is longer nothing is kept, which is no message either"""


class TelemetrySubscriber:
    """Listens to colonies, all of them or one, and passes what it hears to its `watch` whenever it is updated.

    `asks` lets it ask for what it missed, for `history` events before it came, and about robots and arenas; `hear` is
    told everything. Zenoh's threads only enqueue: all else happens on the thread that calls `update`.
    """

    def __init__(
        self,
        session: zenoh.Session,
        colony: str = "*",
        *,
        asks: bool = False,
        history: int = 0,
        on_event: Callable[[TelemetrySample], None] | None = None,
    ) -> None:
        self.monitor = ColonyMonitor(history=history)
        self._session, self._asks, self._on_event = session, asks, on_event
        self._waiting = _Waiting()
        of = ColonyKeys(colony)
        live = session.liveliness()
        self._entities: list[Any] = [
            live.declare_token(key_expressions.observer(str(session.zid()))),
            session.declare_subscriber(of.all_states, self._listen("state")),
            session.declare_subscriber(of.all_events, self._listen("event")),
            session.declare_subscriber(key_expressions.ALL_SCENES, self._listen("scene")),
            live.declare_subscriber(of.all_alive, self._listen("alive"), history=True),
            live.declare_subscriber(
                key_expressions.ALL_ARENAS_ALIVE, self._listen("alive"), history=True
            ),
        ]

    @property
    def dropped(self) -> int:
        """How much was heard and lost since it was too much at once."""
        return self._waiting.dropped

    def poll(self) -> list[StatusChange]:
        """Take in what was heard since the last time, ask what is to be asked, and return what is new."""
        changes: list[StatusChange] = []
        for sample in self._waiting.take_all():
            if self._on_event is not None:
                self._on_event(sample)
            changes += self.monitor.handle_sample(sample)
        unix_s = time.time()
        self.monitor.handle_timeouts(unix_s)
        if self._asks:
            for request in self.monitor.due_requests(unix_s):
                self._ask(request)
        return changes

    def _listen(self, kind: SampleKind) -> Any:
        def on_sample(sample: zenoh.Sample) -> None:
            is_gone = kind == "alive" and sample.kind == zenoh.SampleKind.DELETE
            self._put("gone" if is_gone else kind, sample)

        return Callback(on_sample, indirect=False)

    def _ask(self, request: BackfillRequest) -> None:
        """Ask all who answer to a key: one of them may be an impostor."""

        def on_reply(reply: zenoh.Reply) -> None:
            if reply.ok is not None:
                self._put(request.kind, reply.ok)

        self._session.get(
            request.key,
            Callback(on_reply, indirect=False),
            payload=request.payload,
            timeout=ANSWER_S,
            target=zenoh.QueryTarget.ALL,
            consolidation=zenoh.ConsolidationMode.NONE,
        )

    def _put(self, kind: SampleKind, sample: zenoh.Sample) -> None:
        payload = sample.payload
        data = payload.to_bytes() if len(payload) <= _LONGEST.get(kind, 0) else b""
        self._waiting.put(
            TelemetrySample(kind, str(sample.key_expr), data, int(1000.0 * time.time()))
        )


class _Waiting:
    """What was heard and not looked at yet: bounded. Tokens are not said again and have twice the room."""

    def __init__(self) -> None:
        self.dropped = 0
        self._heard: deque[TelemetrySample] = deque()
        self._bytes = 0
        self._lock = threading.Lock()

    def put(self, sample: TelemetrySample) -> None:
        """Enqueue, from any thread."""
        room = 2 if sample.kind in ("alive", "gone") else 1
        with self._lock:
            if len(self._heard) >= room * _MAX_WAITING or self._bytes >= room * _MAX_BYTES:
                self.dropped += 1
                return
            self._heard.append(sample)
            self._bytes += len(sample.data)

    def take_all(self) -> deque[TelemetrySample]:
        """Return all that waits, in the order in which it came."""
        with self._lock:
            taken, self._heard, self._bytes = self._heard, deque(), 0
        return taken
