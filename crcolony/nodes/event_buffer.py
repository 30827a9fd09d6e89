"""The recent events of one robot, kept for observers that missed some of them."""

import itertools
from collections import deque

from crcolony.protocol.codec import MAX_ENVELOPE_BYTES, encode
from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import (
    MAX_HISTORY_EVENTS,
    EventMessage,
    HistoryReply,
    HistoryRequest,
    RobotEvent,
)

_MAX_EVENTS = 10_000
"""Events that a robot keeps; older ones are discarded."""
MAX_BYTES = 4 * 2**20
"""Their encoded size, unless a process with many robots keeps less of each."""


class EventBuffer:
    """The recent events of one incarnation, encoded and numbered from 1."""

    def __init__(self, robot: RobotId, incarnation: int, max_bytes: int = MAX_BYTES) -> None:
        self.seq = 0
        """Sequence number of the last event"""
        self._robot, self._incarnation = robot, incarnation
        self._messages: deque[bytes] = deque()
        self._max_bytes, self._bytes = max_bytes, 0

    def append(self, event: RobotEvent, unix_ms: int) -> bytes:
        """Number an event, keep it, and return the message to publish."""
        self.seq += 1
        message = encode(EventMessage(self._robot, self._incarnation, self.seq, unix_ms, event))
        self._messages.append(message)
        self._bytes += len(message)
        while len(self._messages) > _MAX_EVENTS or self._bytes > self._max_bytes:
            self._bytes -= len(self._messages.popleft())
        return message

    def reply_to(self, request: HistoryRequest) -> HistoryReply:
        """Return the events from the requested number on, as many as are kept and fit into one reply.

        A request about another incarnation gets no events.
        """
        oldest = self.seq - len(self._messages) + 1
        if request.incarnation != self._incarnation:
            return HistoryReply(self._incarnation, oldest, [])
        start = max(request.first, oldest) - oldest
        messages: list[bytes] = []
        free_bytes = MAX_ENVELOPE_BYTES
        for message in itertools.islice(self._messages, start, start + MAX_HISTORY_EVENTS):
            free_bytes -= len(message)
            if free_bytes < 0:
                break
            messages.append(message)
        return HistoryReply(self._incarnation, oldest, messages)
