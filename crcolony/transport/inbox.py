"""The inbox of a process: every event that arrives waits here for its one loop, and those of bodies come first."""

import math
from queue import Empty, SimpleQueue

from crcolony.transport.bounded_queue import BoundedQueue
from crcolony.transport.interface import (
    ActionReceived,
    ArenaMetadataReceived,
    EnvelopeReceived,
    InboundEvent,
    JoinReplyReceived,
    ObservationReceived,
    QueryReceived,
    SceneReceived,
)

_MAX_EVENTS = 2048
"""Urgent events that wait, and as many others; further ones are dropped and counted."""
_MAX_BYTES = 8 * 2**20
"""Bytes of messages that wait and are not urgent."""
_URGENT = (ObservationReceived, ActionReceived, JoinReplyReceived)
"""Events of a control step."""


class Inbox:
    """A bounded queue with two priorities: observations, actions and replies of the arena precede all other events.

    So a flood of envelopes and queries makes no control step late, and no flood of anything fills the memory. Events of
    presence (a robot or an arena comes online or goes offline) are never dropped.
    """

    def __init__(self) -> None:
        self._urgent: SimpleQueue[InboundEvent | None] = SimpleQueue()
        """`None` wakes the loop; a `SimpleQueue` may be used in a signal handler."""
        self._others = BoundedQueue[InboundEvent](_MAX_EVENTS, _MAX_BYTES)
        self._dropped_urgent = 0

    @property
    def dropped(self) -> int:
        """Events that were dropped because too many waited."""
        return self._dropped_urgent + self._others.dropped

    def deliver(self, event: InboundEvent) -> None:
        """Enqueue an event, from any thread."""
        if isinstance(event, _URGENT):
            if self._urgent.qsize() < _MAX_EVENTS:
                self._urgent.put(event)
            else:
                self._dropped_urgent += 1
        elif self._put_other(event) and self._urgent.empty():
            self.wake()

    def _put_other(self, event: InboundEvent) -> bool:
        match event:
            case (
                EnvelopeReceived(envelope=message)
                | QueryReceived(payload=message)
                | SceneReceived(scene=message)
                | ArenaMetadataReceived(metadata=message)
            ):
                return self._others.put(event, len(message))
        return self._others.put(event, 0, limit_factor=math.inf)

    def wake(self) -> None:
        """Let the loop that waits in `get` continue; safe in a signal handler."""
        self._urgent.put(None)

    def get(self, timeout_s: float) -> InboundEvent | None:
        """Wait for the next event and return it; return None after the timeout, or when woken."""
        is_woken = False
        try:
            while (event := self._urgent.get(False)) is None:
                is_woken = True
        except Empty:
            if is_woken or self._others or timeout_s <= 0.0:
                return self._others.get()
            try:
                event = self._urgent.get(timeout=timeout_s)
            except Empty:
                return None
        return event or self._others.get()
