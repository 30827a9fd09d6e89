"""Schedules the requests of a monitor: for missed events and for metadata, few at a time, and with limited retries.

No I/O and no clock.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple

from crcolony.protocol.codec import encode
from crcolony.protocol.identity import RobotId
from crcolony.protocol.key_expressions import ArenaKeys, ColonyKeys
from crcolony.protocol.telemetry_messages import HistoryRequest
from crcolony.telemetry.robot_status import ArenaStatus, RobotStatus
from crcolony.telemetry.sequence_gaps import MAX_TRIES

REPLY_TIMEOUT_S = 2.0
"""After it a request is retried, or given up."""
MAX_PENDING = 20
"""Requests that wait for their replies at one time."""
_MAX_PENDING_METADATA = 10
"""Requests for metadata among them, so that nodes that never reply leave room for requests of events."""
ROBOTS_PER_PERIOD = 32
"""Robots whose metadata is requested again in every period, in turn."""

NodeName = RobotId | str
"""A robot by its id, or an arena by its name"""
RequestKind = Literal["history", "metadata"]


class BackfillRequest(NamedTuple):
    """A request to be sent: for missed events (an encoded `HistoryRequest`), or for metadata (no payload)."""

    key: str
    payload: bytes

    @property
    def kind(self) -> RequestKind:
        """The kind of its replies."""
        return "history" if self.payload else "metadata"


@dataclass(frozen=True)
class PendingRequest:
    """A request that waits for its reply."""

    sent_s: float
    kind: RequestKind
    incarnation: int = 0
    first: int = 0
    """Sequence number of the first event that was requested"""
    tries: int = 0
    """Earlier requests for this metadata without a reply"""


class BackfillScheduler:
    """Remembers which events and metadata to request; every node has at most one pending request."""

    def __init__(self, metadata_period_s: float) -> None:
        self._metadata_period_s = metadata_period_s
        self._history_queue: dict[RobotId, None] = {}
        """Robots with missing events, the one whose last request is oldest first"""
        self._metadata_queue: dict[NodeName, int] = {}
        """Nodes whose metadata is to be requested, and the tries without a reply"""
        self._pending: dict[NodeName, PendingRequest] = {}
        self._period_ends_s = 0.0
        self._next_robot = 0
        """Index among the robots online of the next whose metadata is requested again"""

    def request_history(self, robot: RobotId) -> None:
        """Schedule requests for the missing events of a robot."""
        self._history_queue.setdefault(robot)

    def request_metadata(self, node: NodeName) -> None:
        """Schedule a request for metadata: a robot has a new incarnation, or an arena a new run."""
        self._metadata_queue[node] = 0

    def cancel(self, node: NodeName) -> None:
        """Cancel all requests to a node."""
        self._metadata_queue.pop(node, None)
        self._pending.pop(node, None)
        if isinstance(node, bytes):
            self._history_queue.pop(node, None)

    def complete(self, node: NodeName, kind: RequestKind) -> PendingRequest | None:
        """Handle a reply; return the pending request that it completes, if there is one."""
        if kind == "metadata":
            self._metadata_queue.pop(node, None)
        pending = self._pending.get(node)
        return self._pending.pop(node) if pending is not None and pending.kind == kind else None

    def due_requests(
        self,
        unix_s: float,
        robots: Mapping[RobotId, RobotStatus],
        arenas: Mapping[str, ArenaStatus],
    ) -> list[BackfillRequest]:
        """Return the requests to send now."""
        self._handle_timeouts(unix_s, robots)
        self._schedule_periodic_metadata(unix_s, robots)
        return [
            *self._due_metadata_requests(unix_s, robots, arenas),
            *self._due_history_requests(unix_s, robots),
        ]

    def _handle_timeouts(self, unix_s: float, robots: Mapping[RobotId, RobotStatus]) -> None:
        """Retry or give up requests without a reply, and requests from the future: the clock was set back."""
        for node, pending in list(self._pending.items()):
            if 0.0 <= unix_s - pending.sent_s < REPLY_TIMEOUT_S:
                continue
            del self._pending[node]
            if pending.kind == "metadata":
                if pending.tries + 1 < MAX_TRIES:
                    self._metadata_queue.setdefault(node, pending.tries + 1)
            elif isinstance(node, bytes):
                status = robots[node]
                if status.sequence is not None and status.incarnation == pending.incarnation:
                    status.sequence.handle_no_reply(pending.first)

    def _schedule_periodic_metadata(
        self, unix_s: float, robots: Mapping[RobotId, RobotStatus]
    ) -> None:
        """Schedule, once a period, requests for the metadata of the next robots."""
        if 0.0 < self._period_ends_s - unix_s <= self._metadata_period_s:
            return
        self._period_ends_s = unix_s + self._metadata_period_s
        online = [robot for robot, status in robots.items() if status.is_alive]
        for index in range(
            self._next_robot, self._next_robot + min(ROBOTS_PER_PERIOD, len(online))
        ):
            self._metadata_queue.setdefault(online[index % len(online)], 0)
        self._next_robot = (self._next_robot + ROBOTS_PER_PERIOD) % max(len(online), 1)

    def _due_metadata_requests(
        self,
        unix_s: float,
        robots: Mapping[RobotId, RobotStatus],
        arenas: Mapping[str, ArenaStatus],
    ) -> list[BackfillRequest]:
        requests: list[BackfillRequest] = []
        pending = sum(request.kind == "metadata" for request in self._pending.values())
        for node in list(self._metadata_queue):
            is_full = len(requests) + pending >= _MAX_PENDING_METADATA
            if is_full or len(self._pending) >= MAX_PENDING:
                break
            if node in self._pending:
                continue
            tries = self._metadata_queue.pop(node)
            key = _metadata_key(node, robots, arenas)
            if key is not None:
                self._pending[node] = PendingRequest(unix_s, "metadata", tries=tries)
                requests.append(BackfillRequest(key, b""))
        return requests

    def _due_history_requests(
        self, unix_s: float, robots: Mapping[RobotId, RobotStatus]
    ) -> list[BackfillRequest]:
        requests: list[BackfillRequest] = []
        for robot in list(self._history_queue):
            if len(self._pending) >= MAX_PENDING:
                break
            status = robots[robot]
            if status.sequence is None or not status.sequence.missing:
                del self._history_queue[robot]
                continue
            first = status.sequence.first_due(unix_s)
            if first is None or not status.is_alive or robot in self._pending:
                continue
            self._history_queue[robot] = self._history_queue.pop(robot)
            self._pending[robot] = PendingRequest(unix_s, "history", status.incarnation, first)
            key = ColonyKeys(status.colony).history(robot)
            payload = encode(HistoryRequest(status.incarnation, first))
            requests.append(BackfillRequest(key, payload))
        return requests


def _metadata_key(
    node: NodeName, robots: Mapping[RobotId, RobotStatus], arenas: Mapping[str, ArenaStatus]
) -> str | None:
    """Return the key of the metadata of a node, or None if it is offline."""
    if isinstance(node, str):
        return ArenaKeys(node).metadata if arenas[node].is_alive else None
    status = robots[node]
    return ColonyKeys(status.colony).metadata(node) if status.is_alive else None
