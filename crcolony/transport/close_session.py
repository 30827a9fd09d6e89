"""Closes a session in bounded time, also on a starved machine: what a process had to save is saved by then."""

import contextlib
import sys
import threading
from collections.abc import Iterator

import zenoh

from crcolony.transport.zenoh_session import Session

_TIMEOUT_S = 12.0
"""Zenoh itself gives up after 10 s."""


def close_session(session: Session) -> None:
    """Close a session. One that cannot be closed in time is left to the end of the process, which one line says."""
    problem = [f"not closed within {_TIMEOUT_S:g} s"]

    def close() -> None:
        try:
            session.close()  # type: ignore[no-untyped-call]
        except zenoh.ZError as error:
            problem[0] = str(error).partition(" at /")[0]
        else:
            problem.clear()

    closing = threading.Thread(target=close, name="close session", daemon=True)
    closing.start()
    closing.join(_TIMEOUT_S)
    if problem:
        line = f"the network was not left in time; peers notice it later ({problem[0]})"
        print(line, file=sys.stderr, flush=True)


@contextlib.contextmanager
def closing(session: Session) -> Iterator[Session]:
    """A context that closes a session at its end."""
    try:
        yield session
    finally:
        close_session(session)
