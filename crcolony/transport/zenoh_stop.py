"""The emergency stop over Zenoh: bridges answer it, and a command asks all of them at once."""

import contextlib
import threading
from collections.abc import Callable, Iterator

import zenoh

from crcolony.protocol.key_expressions import ALL_STOPPABLE, ALL_STOPS, ArenaKeys, parse_stoppable
from crcolony.protocol.stop_messages import MAX_REPLY_BYTES
from crcolony.transport.zenoh_samples import callback, payload_bytes, query_bytes, reply_once


@contextlib.contextmanager
def answering_stops(
    session: zenoh.Session, arena: str, answer: Callable[[bytes], bytes | None]
) -> Iterator[None]:
    """Answer stops inside the context, each on a thread of its own: they wait for nothing else of the process.

    `answer` receives the message, and returns the reply or None for none.
    """
    keys = ArenaKeys(arena)

    def on_query(query: zenoh.Query) -> None:
        message, reply = query_bytes(query), reply_once(query, keys.stop)

        def run() -> None:
            data = answer(message)
            if data is not None:
                reply(data)

        threading.Thread(target=run, name="emergency stop", daemon=True).start()

    queryable = session.declare_queryable(keys.stop, callback(on_query))
    token = session.liveliness().declare_token(keys.stoppable(str(session.zid())))
    try:
        yield
    finally:
        token.undeclare()  # type: ignore[no-untyped-call]
        queryable.undeclare()  # type: ignore[no-untyped-call]


def ask_to_stop(
    session: zenoh.Session, arena: str, message: bytes, timeout_s: float
) -> tuple[dict[str, bytes], set[str]]:
    """Send a message to the bridge of this name, "*" for all.

    Returns the replies by bridge, and the names of the bridges that are there and have not answered.
    """
    replies: dict[str, bytes] = {}
    key = ALL_STOPS if arena == "*" else ArenaKeys(arena).stop
    for reply in session.get(
        key,
        payload=message,
        target=zenoh.QueryTarget.ALL,
        consolidation=zenoh.ConsolidationMode.NONE,
        timeout=timeout_s,
    ):
        if reply.ok is not None:
            bridge = str(reply.ok.key_expr).split("/")[-2]
            replies[bridge] = payload_bytes(reply.ok.payload, MAX_REPLY_BYTES)
    present = {
        name
        for token in session.liveliness().get(ALL_STOPPABLE, timeout=timeout_s)
        if token.ok is not None
        and (name := parse_stoppable(str(token.ok.key_expr))) is not None
        and arena in ("*", name)
    }
    return replies, present - replies.keys()
