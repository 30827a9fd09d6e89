"""The emergency stop over Zenoh: arenas and bridges answer it, and a command asks all of them at once."""

import threading
from collections.abc import Callable, Sequence
from typing import Any

import zenoh

from crcolony.protocol.key_expressions import ALL_STOPPABLE, ALL_STOPS, ArenaKeys, parse_stoppable
from crcolony.protocol.stop_messages import MAX_OTHERS, MAX_REPLY_BYTES, StopAddress
from crcolony.transport.zenoh_samples import (
    callback,
    leaving,
    payload_bytes,
    query_bytes,
    reply_once,
)

_MAX_KNOWN = 10_000
"""Tokens that are remembered; anybody may declare any number."""


Answer = Callable[[bytes, StopAddress, Sequence[StopAddress]], bytes | None]


class _Others:
    """The arenas and bridges that a session sees, but for its own. Threads of Zenoh add and remove them."""

    def __init__(self, own: StopAddress) -> None:
        self._own = own
        self._known: set[StopAddress] = set()
        self._mutex = threading.Lock()

    def handle(self, sample: zenoh.Sample) -> None:
        """Follow a token."""
        address = parse_stoppable(str(sample.key_expr))
        if address is None or address == self._own:
            return
        with self._mutex:
            if sample.kind == zenoh.SampleKind.DELETE:
                self._known.discard(address)
            elif len(self._known) < _MAX_KNOWN:
                self._known.add(address)

    def named(self) -> list[StopAddress]:
        """Return those that fit into a reply."""
        with self._mutex:
            return sorted(self._known)[:MAX_OTHERS]


class StopAnswers:
    """Answers stops, each on a thread of its own: they wait for nothing else of the process.

    `answer` receives the message, the own address, and the other arenas and bridges that are there; it returns the
    reply, None for none.
    """

    def __init__(self, session: zenoh.Session, arena: str, answer: Answer) -> None:
        self._arena, self._answer = arena, answer
        self._declare(session)

    def _declare(self, session: zenoh.Session) -> None:
        keys, own = ArenaKeys(self._arena), StopAddress(self._arena, str(session.zid()))
        others = _Others(own)

        def on_query(query: zenoh.Query) -> None:
            message, reply = query_bytes(query), reply_once(query, keys.stop)

            def run() -> None:
                data = self._answer(message, own, others.named())
                if data is not None:
                    reply(data)

            threading.Thread(target=run, name="emergency stop", daemon=True).start()

        live = session.liveliness()
        self._entities: list[Any] = [
            live.declare_subscriber(ALL_STOPPABLE, callback(others.handle), history=True),
            session.declare_queryable(keys.stop, callback(on_query)),
            live.declare_token(keys.stoppable(own.session)),
        ]

    def move_to(self, session: zenoh.Session) -> Callable[[], None]:
        """Answer in another session; return a function that ends it in the former one."""
        former = self._entities
        self._declare(session)
        return leaving(former)


def ask_to_stop(
    session: zenoh.Session, arena: str, message: bytes, timeout_s: float
) -> tuple[list[bytes], set[StopAddress]]:
    """Send a message to the arenas and bridges of this name, "*" for all.

    Returns the replies, and the arenas and bridges of the name that this session sees.
    """
    key = ALL_STOPS if arena == "*" else ArenaKeys(arena).stop
    replies = [
        payload_bytes(reply.ok.payload, MAX_REPLY_BYTES)
        for reply in session.get(
            key,
            payload=message,
            target=zenoh.QueryTarget.ALL,
            consolidation=zenoh.ConsolidationMode.NONE,
            timeout=timeout_s,
        )
        if reply.ok is not None
    ]
    seen = {
        address
        for token in session.liveliness().get(ALL_STOPPABLE, timeout=timeout_s)
        if token.ok is not None
        and (address := parse_stoppable(str(token.ok.key_expr))) is not None
        and arena in ("*", address.arena)
    }
    return replies, seen
