"""Passes on the roster of a deployment over Zenoh, and keeps the newest in the member's folder of credentials."""

import contextlib
import random
from collections.abc import Callable
from queue import Empty, SimpleQueue
from typing import Any

import zenoh

from crcolony.protocol.key_expressions import roster_key, roster_serial_key
from crcolony.protocol.roster import MAX_ROSTER_BYTES, Roster
from crcolony.protocol.roster_gossip import Announce, Publish, Request, RosterGossip
from crcolony.transport.credentials import Credentials, store_roster
from crcolony.transport.zenoh_samples import callback, leaving, payload_bytes

_MAX_WAITING = 64
"""Messages that wait for the process's loop; further ones are dropped, and sent again by honest members."""
_REQUEST_TIMEOUT_S = 1.0
_MAX_BYTES = MAX_ROSTER_BYTES + 128


class RosterExchange:
    """The roster of one member. Zenoh's threads only enqueue; the process's loop calls `handle_timers`."""

    def __init__(self, session: zenoh.Session, credentials: Credentials) -> None:
        self._folder, self._colony = credentials.folder, credentials.record.colony
        self._gossip = RosterGossip(
            credentials.signed_roster,
            credentials.roster,
            credentials.record.key_bytes,
            random.SystemRandom().random,
        )
        self._announced: SimpleQueue[bytes] = SimpleQueue()
        self._rosters: SimpleQueue[bytes] = SimpleQueue()
        self._is_linked = False
        self.has_published = False
        """Whether others had an older roster: they give this member its rights within some seconds"""
        self._entities: list[Any] = []
        self._session = session
        self.move_to(session)

    @property
    def roster(self) -> Roster:
        """The newest roster."""
        return self._gossip.roster

    @property
    def is_agreed(self) -> bool:
        """Whether another member has announced that it has the same roster."""
        return self._gossip.is_agreed

    def move_to(self, session: zenoh.Session) -> Callable[[], None]:
        """Use another session; return a function that undeclares what the former one has."""
        former, self._session = self._entities, session
        key = roster_key(self._colony)
        session.info.declare_link_events_listener(callback(self._on_link), history=True)
        others = zenoh.Locality.REMOTE
        self._entities = [
            session.declare_subscriber(key, callback(self._on_roster), allowed_origin=others),
            session.declare_subscriber(
                roster_serial_key(self._colony), callback(self._on_serial), allowed_origin=others
            ),
            session.declare_queryable(key, callback(self._on_request)),
        ]
        return leaving(former)

    def handle_timers(self, now_s: float) -> bool:
        """Handle what has arrived, and send what is due; return whether there is a newer roster now."""
        if self._is_linked:
            self._is_linked = False
            self._gossip.handle_link(now_s)
        for data in _taken(self._announced):
            self._gossip.handle_announcement(now_s, data)
        is_newer = False
        for data in _taken(self._rosters):
            is_newer = self._gossip.handle_roster(now_s, data) or is_newer
        if is_newer:
            store_roster(self._folder, self._gossip.signed)
        for action in self._gossip.due_actions(now_s):
            self._carry_out(action)
        return is_newer

    def _carry_out(self, action: Announce | Publish | Request) -> None:
        with contextlib.suppress(zenoh.ZError):  # no session at the moment; it is announced again
            match action:
                case Announce(message):
                    self._put(roster_serial_key(self._colony), message)
                case Publish(roster):
                    self.has_published = True
                    self._put(roster_key(self._colony), roster)
                case Request(message):
                    self._session.get(
                        roster_key(self._colony),
                        callback(self._on_reply),
                        payload=message,
                        target=zenoh.QueryTarget.ALL,
                        consolidation=zenoh.ConsolidationMode.NONE,
                        timeout=_REQUEST_TIMEOUT_S,
                    )

    def _put(self, key: str, data: bytes) -> None:
        self._session.put(key, data, congestion_control=zenoh.CongestionControl.DROP, express=True)

    def _on_link(self, event: zenoh.LinkEvent) -> None:
        if event.kind == zenoh.SampleKind.PUT:
            self._is_linked = True

    def _on_roster(self, sample: zenoh.Sample) -> None:
        if self._rosters.qsize() < _MAX_WAITING:
            self._rosters.put(payload_bytes(sample.payload, _MAX_BYTES))

    def _on_reply(self, reply: zenoh.Reply) -> None:
        if reply.ok is not None:
            self._on_roster(reply.ok)

    def _on_serial(self, sample: zenoh.Sample) -> None:
        if self._announced.qsize() < _MAX_WAITING:
            self._announced.put(payload_bytes(sample.payload, _MAX_BYTES))

    def _on_request(self, query: zenoh.Query) -> None:
        request = b"" if query.payload is None else payload_bytes(query.payload, _MAX_BYTES)
        answer = self._gossip.answer(request)
        with query:
            if answer is not None:
                query.reply(query.key_expr, answer)


def _taken(queue: SimpleQueue[bytes]) -> list[bytes]:
    taken = []
    with contextlib.suppress(Empty):
        while True:
            taken.append(queue.get_nowait())
    return taken
