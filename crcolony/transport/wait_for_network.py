"""Opens a session as soon as the network is there: a machine may boot before its interface, its DNS or its router."""

import contextlib
import threading
import time
from collections.abc import Callable, Iterator
from queue import Empty, SimpleQueue

from crcolony.transport.connection import Connection
from crcolony.transport.interface import NetworkError, NetworkUnavailableError
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_session import Session, check_network, open_session

_RETRY_S = 0.5
_POLL_S = 0.1
"""How soon a shutdown is noticed while a name is looked up."""


@contextlib.contextmanager
def open_connection(
    network: NetworkSettings,
    is_stopped: Callable[[], bool],
    print_line: Callable[[str], None],
) -> Iterator[Connection | None]:
    """Wait for the network, and be connected to it inside the context; None if it is stopped before.

    `print_line` is called when it waits, and from another thread when nobody answers at an endpoint.
    """
    session = wait_for_session(network, is_stopped, print_line)
    if session is None:
        yield None
        return
    with Connection(network, session, print_line) as connection:
        yield connection


def wait_for_session(
    network: NetworkSettings,
    is_stopped: Callable[[], bool],
    print_line: Callable[[str], None],
) -> Session | None:
    """Return an open session once the network can be used, or None if it is stopped before.

    While it waits, each new reason is printed once. Raises NetworkError for settings that can never be used.
    """
    printed = ""
    while not is_stopped():
        try:
            _check_in_background(network, is_stopped)
            if is_stopped():
                break
            session = open_session(network)
        except NetworkUnavailableError as error:
            if str(error) != printed:
                printed = str(error)
                print_line(f"waiting for the network: {error}")
            time.sleep(_RETRY_S)
        else:
            if printed:
                print_line("the network is there")
            return session
    return None


def _check_in_background(network: NetworkSettings, is_stopped: Callable[[], bool]) -> None:
    """Check the network on another thread, as looking up a name may block for seconds; raises as `check_network`."""
    found: SimpleQueue[NetworkError | None] = SimpleQueue()

    def check() -> None:
        try:
            check_network(network)
        except NetworkError as error:
            found.put(error)
        else:
            found.put(None)

    threading.Thread(target=check, name="network check", daemon=True).start()
    while not is_stopped():
        with contextlib.suppress(Empty):
            problem = found.get(timeout=_POLL_S)
            if problem is not None:
                raise problem
            return
