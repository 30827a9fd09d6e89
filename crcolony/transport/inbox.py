"""The inbox of a process: every event that arrives waits here for its one loop, and those of bodies come first."""

import math
import sys
from collections import deque
from collections.abc import Callable

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
from crcolony.transport.wakeup import LinuxWakeup, QueueWakeup

_MAX_EVENTS = 2048
"""Urgent events that wait, and as many others; further ones are dropped and counted."""
_MAX_BYTES = 8 * 2**20
"""Bytes of messages that wait and are not urgent."""
_URGENT = (ObservationReceived, ActionReceived, JoinReplyReceived)
"""Events of a control step."""


class Inbox:
    """A bounded queue with two priorities: observations, actions and replies of the arena precede all other events.

    So a flood of envelopes and queries makes no control step late, and no flood of anything fills the memory. Events of
    presence (a robot or an arena comes online or goes offline) are never dropped. On Linux the loop also waits for
    files, as those of local links, and their events are urgent.
    """

    def __init__(self) -> None:
        self._urgent: deque[InboundEvent] = deque()
        self._others = BoundedQueue[InboundEvent](_MAX_EVENTS, _MAX_BYTES)
        self._dropped_urgent = 0
        self._handlers: dict[int, Callable[[], None]] = {}
        """What to do when a file is ready, by its descriptor"""
        self._wakeup = LinuxWakeup() if sys.platform == "linux" else QueueWakeup()

    @property
    def dropped(self) -> int:
        """Events that were dropped because too many waited."""
        return self._dropped_urgent + self._others.dropped

    @property
    def is_empty(self) -> bool:
        """Whether nothing waits."""
        return not self._urgent and not self._others

    def deliver(self, event: InboundEvent) -> None:
        """Enqueue an event, from any thread."""
        if not isinstance(event, _URGENT):
            is_put = self._put_other(event)
        elif is_put := len(self._urgent) < _MAX_EVENTS:
            self._urgent.append(event)
        else:
            self._dropped_urgent += 1
        if is_put:
            self._wakeup.ring()

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
        self._wakeup.ring()

    def get(self, timeout_s: float) -> InboundEvent | None:
        """Wait for the next event and return it; return None after the timeout, when woken, or for files' sake."""
        # What a link on this machine brings precedes all that the network has brought, however much that is.
        has_handled = bool(self._handlers) and self._handle_files(0.0)
        if not has_handled and not self._urgent and not self._others and timeout_s > 0.0:
            self._handle_files(timeout_s)
        return self._urgent.popleft() if self._urgent else self._others.get()

    def _handle_files(self, timeout_s: float) -> bool:
        """Handle the files that are ready; return whether there were any."""
        ready = self._wakeup.wait(timeout_s)
        self._handle(ready)
        return bool(ready)

    def _handle(self, ready: list[int]) -> None:
        for descriptor, handle in [(each, self._handlers.get(each)) for each in ready]:
            # It may have been forgotten a moment ago, and another file may have its number now.
            if handle is not None and self._handlers.get(descriptor) is handle:
                handle()

    # Files, on Linux only -------------------------------------------------------------------------------------------

    def wait_for_bell(self, bell: int, timeout_s: float) -> bool:
        """Wait, and return whether nothing happened but that an eventfd was rung, which is not handled then.

        Everything else is handled, and waits for `get`; to be called when that has returned everything.
        """
        if timeout_s <= 0.0:
            return False
        ready = self._wakeup.wait(timeout_s)
        if ready == [bell]:
            return True
        self._handle(ready)
        return False

    def put_urgent(self, event: InboundEvent) -> None:
        """Enqueue an event of a file that is ready; only for handlers, in the loop's own thread."""
        self._urgent.appendleft(event)

    def watch(self, descriptor: int, handle: Callable[[], None], is_bell: bool = False) -> None:
        """Call a function, in the loop, as long as a file has something to read, or whenever an eventfd is rung."""
        self._wakeup.watch(descriptor, is_bell)
        self._handlers[descriptor] = handle

    def forget(self, descriptor: int) -> None:
        """Watch a file no more; it must still be open."""
        self._wakeup.forget(descriptor)
        del self._handlers[descriptor]
