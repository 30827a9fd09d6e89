"""Replaces the session of a process without a gap: its successor is open and connected before it is closed.

Zenoh reads the certificate of a listener, and its access control, only when a session is opened. So a renewed
certificate or another roster needs another session. Where a process listens on a fixed port, which only one session can
have, a third one stands in between.
"""

import threading
import time
from collections.abc import Callable, Iterator, Sequence
from queue import Empty, SimpleQueue
from typing import Protocol

import msgspec

from crcolony.transport.close_session import close_session
from crcolony.transport.endpoint import UNIX_SOCKET, parse_endpoint, socket_address
from crcolony.transport.interface import NetworkError
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_session import Session, free_port, open_session, sessions_of_peers

_LINK_TIMEOUT_S = 3.0
"""How long the successor may take until it is connected to all to whom the former session is."""
_OVERLAP_S = 0.5
"""Both sessions are used for so long: what is under way over the former one arrives."""
_POLL_S = 0.02
_CANCEL_POLL_S = 0.1
_RETRY_S = 2.0


class SessionUser(Protocol):
    """What has declared something in a session."""

    def move_to(self, session: Session) -> Callable[[], None]:
        """Declare it in another session, too; return a function that undeclares it in the former one."""
        ...


class SessionRenewal:
    """One replacement of a session; `users` are what has declared something in it.

    Sessions are opened and closed on a thread of its own. `handle_timers` moves the users, on the process's own thread.
    """

    def __init__(
        self,
        network: NetworkSettings,
        session: Session,
        users: Sequence[SessionUser],
        print_line: Callable[[str], None],
    ) -> None:
        self.session = session
        """The session in use"""
        self.is_done = False
        self._network, self._users, self._print_line = network, users, print_line
        self._opened: SimpleQueue[Session] = SimpleQueue()
        self._undeclare: list[Callable[[], None]] = []
        self._retire_due_s = 0.0
        self._is_moved, self._is_cancelled = threading.Event(), threading.Event()
        self._thread = threading.Thread(
            target=self._run, args=(session,), name="session renewal", daemon=True
        )
        self._thread.start()

    def handle_timers(self, now_s: float) -> None:
        """Move the users to a session that has been opened, and leave the former one when that is due."""
        if self._undeclare:
            if now_s >= self._retire_due_s:
                for undeclare in self._undeclare:
                    undeclare()
                self._undeclare = []
                self._is_moved.set()
            return
        try:
            session = self._opened.get_nowait()
        except Empty:
            self.is_done = not self._thread.is_alive()
            return
        self.session = session
        self._undeclare = [user.move_to(session) for user in self._users]
        self._retire_due_s = now_s + _OVERLAP_S

    def cancel(self) -> None:
        """Open no further session; close those that are not in use."""
        self._is_cancelled.set()
        self._thread.join()
        while not self._opened.empty():
            close_session(self._opened.get())

    def _run(self, former: Session) -> None:
        for network in hops(self._network):
            session = self._open(network)
            if session is None:
                return
            self._wait_for_links(former, session)
            self._is_moved.clear()
            self._opened.put(session)
            while not (self._is_moved.wait(_CANCEL_POLL_S) or self._is_cancelled.is_set()):
                pass
            if self.session is not session:  # cancelled before it was used
                return
            close_session(former)
            former = session

    def _open(self, network: NetworkSettings) -> Session | None:
        """Open a session, with as many attempts as it takes; None if that is cancelled."""
        while not self._is_cancelled.is_set():
            try:
                return open_session(network)
            except NetworkError as error:
                self._print_line(f"the session cannot be renewed yet: {error}")
                self._is_cancelled.wait(_RETRY_S)
        return None

    def _wait_for_links(self, former: Session, session: Session) -> None:
        deadline_s = time.monotonic() + _LINK_TIMEOUT_S
        while time.monotonic() < deadline_s and not self._is_cancelled.is_set():
            own = {str(former.zid()), str(session.zid())}
            if sessions_of_peers(former) <= sessions_of_peers(session) | own:
                return
            time.sleep(_POLL_S)


def hops(network: NetworkSettings) -> Iterator[NetworkSettings]:
    """Yield the settings of the sessions that are opened one after the other, the last with those of the process."""
    fixed = [text for text in network.listen if _has_fixed_port(text)]
    if not fixed:
        yield network
        return
    stand_in = msgspec.structs.replace(
        network,
        listen=tuple(map(_at_free_port, network.listen)),
        connect=(*network.connect, *network.listen),
    )
    yield stand_in
    yield msgspec.structs.replace(network, connect=(*network.connect, *stand_in.listen))


def _has_fixed_port(text: str) -> bool:
    return parse_endpoint(text, to_listen=True).port != 0


def _at_free_port(text: str) -> str:
    """Return the endpoint with another port of the same address that is free now."""
    endpoint = parse_endpoint(text, to_listen=True)
    if endpoint.protocol == UNIX_SOCKET:
        return text
    address = socket_address(endpoint.host, free_port(endpoint.host))
    return str(endpoint._replace(address=address))
