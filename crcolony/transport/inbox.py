"""Where everything that arrives waits for the one loop of a process: bounded, and what bodies say comes first."""

import threading
from collections import deque
from queue import Empty, SimpleQueue

from crcolony.transport.interface import (
    ActionReceived,
    EnvelopeReceived,
    InboundEvent,
    JoinReplyReceived,
    ObservationReceived,
    QueryReceived,
    SceneReceived,
)

_MAX_WAITING, _MAX_BYTES = 2048, 8 * 2**20
"""What waits to be looked at, at most; beyond it, it is dropped and counted. Presence is never dropped."""


class Inbox:
    """What has arrived and waits for the one loop of the process. What bodies and minds say is looked at first.

    So a flood of letters and questions makes no control step late, and no flood of anything fills the memory.
    """

    def __init__(self) -> None:
        self.dropped = 0
        self._first: SimpleQueue[InboundEvent | None] = SimpleQueue()
        self._later: deque[InboundEvent] = deque()
        self._bytes = 0
        """Of the letters and questions in `_later`"""
        self._lock = threading.Lock()

    def deliver(self, event: InboundEvent) -> None:
        """Enqueue, from any thread."""
        if isinstance(event, ObservationReceived | ActionReceived | JoinReplyReceived):
            if self._first.qsize() < _MAX_WAITING:
                self._first.put(event)
            else:
                self.dropped += 1
            return
        with self._lock:
            size, is_needed = (
                _size(event),
                not isinstance(event, EnvelopeReceived | QueryReceived | SceneReceived),
            )
            has_room = len(self._later) < _MAX_WAITING and self._bytes + size <= _MAX_BYTES
            if not (has_room or is_needed):
                self.dropped += 1
                return
            self._bytes += size
            self._later.append(event)
        if self._first.empty():
            self.wake()

    def wake(self) -> None:
        """Let whoever waits look around; safe in a signal handler."""
        self._first.put(None)

    def get(self, timeout_s: float) -> InboundEvent | None:
        """Wait for the next arrival; None after the time, or when woken."""
        is_woken = False
        try:
            while (event := self._first.get(False)) is None:
                is_woken = True
        except Empty:
            if is_woken or self._later or timeout_s <= 0.0:
                return self._next()
            try:
                event = self._first.get(timeout=timeout_s)
            except Empty:
                return None
        return event or self._next()

    def _next(self) -> InboundEvent | None:
        with self._lock:
            if not self._later:
                return None
            event = self._later.popleft()
            self._bytes -= _size(event)
            return event


def _size(event: InboundEvent) -> int:
    match event:
        case (
            EnvelopeReceived(envelope=data)
            | QueryReceived(payload=data)
            | SceneReceived(scene=data)
        ):
            return len(data)
    return 0
