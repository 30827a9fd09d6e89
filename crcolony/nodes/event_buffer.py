"""The recent events of one robot process, kept for observers that missed some of them."""

import itertools
from collections import deque
from typing import Any

from crcolony.protocol.codec import (
    MAX_ENVELOPE_BYTES,
    encode,
)
from crcolony.protocol.telemetry_messages import (
    MAX_HISTORY_EVENTS,
    EventMessage,
    HistoryReply,
    HistoryRequest,
)

_RING = 10_000
"""Events that a robot keeps for observers who missed them."""


class EventBuffer:
    """The recent events of one life, encoded and numbered, for those who missed some."""

    def __init__(self, robot: bytes, incarnation: int) -> None:
        self.seq = 0
        self._robot, self._life = robot, incarnation
        self._kept: deque[bytes] = deque(maxlen=_RING)

    def append(self, event: Any, unix_ms: int) -> bytes:
        """Number an event, keep it, and return it as it is published."""
        self.seq += 1
        message = encode(EventMessage(self._robot, self._life, self.seq, unix_ms, event))
        self._kept.append(message)
        return message

    def reply_to(self, ask: HistoryRequest) -> HistoryReply:
        """Return the events from the asked number on, as many as are kept and fit into one answer."""
        oldest = self.seq - len(self._kept) + 1
        if ask.incarnation != self._life:
            return HistoryReply(self._life, oldest, [])
        start = max(ask.first, oldest) - oldest
        message: list[bytes] = []
        room = MAX_ENVELOPE_BYTES
        for data in itertools.islice(self._kept, start, start + MAX_HISTORY_EVENTS):
            room -= len(data)
            if room < 0:
                break
            message.append(data)
        return HistoryReply(self._life, oldest, message)
