"""The connection of a process to the network, for as long as it runs, whatever happens to its session.

With credentials it passes on the roster, and opens another session when a certificate was renewed or a newer roster has
arrived (`session_renewal.py`).
"""

import random
from collections.abc import Callable
from pathlib import Path

from crcolony.protocol.roster import Roster
from crcolony.transport.close_session import close_session
from crcolony.transport.connection_check import ConnectionCheck
from crcolony.transport.credentials import IDENTITY_FILE, load_credentials
from crcolony.transport.interface import NetworkError
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.roster_exchange import RosterExchange
from crcolony.transport.session_renewal import SessionRenewal, SessionUser
from crcolony.transport.zenoh_session import Session, has_links, open_session

_CERTIFICATE_PERIOD_S = 1.0
"""How often the file of the certificate is looked at."""
_RETRY_S = 0.5
_ROSTER_DELAY_S = 2.0
"""After another roster a session is renewed within this time, at a random moment: not all members at once."""


class Connection:
    """An open session, which is replaced when it has to be; its users are moved to the next one.

    `print_line` is called, also from other threads, when nobody answers at an endpoint.
    """

    def __init__(
        self, network: NetworkSettings, session: Session, print_line: Callable[[str], None]
    ) -> None:
        self.session = session
        self.check = ConnectionCheck(network.connect, lambda: has_links(self.session), print_line)
        """What is known of the endpoints to which it connects"""
        self._network, self._print_line = network, print_line
        self._users: list[SessionUser] = []
        self._roster_handlers: list[Callable[[Roster], None]] = []
        self._exchange: RosterExchange | None = None
        self._renewal: SessionRenewal | None = None
        self._renewal_due_s: float | None = None
        self._certificate_due_s = 0.0
        if network.credentials is not None:
            self._exchange = RosterExchange(session, load_credentials(network.credentials))
            self._users.append(self._exchange)
            self._certificate = _version_of(network.credentials)

    def __enter__(self) -> "Connection":
        self.check.__enter__()
        return self

    def __exit__(self, *_: object) -> None:
        self.check.__exit__(None, None, None)
        if self._renewal is not None:
            self._renewal.cancel()
        close_session(self.session)

    def add_user(self, user: SessionUser) -> None:
        """Move what has declared something in the session to every later one."""
        self._users.append(user)

    def on_roster(self, handle: Callable[[Roster], None]) -> None:
        """Call a function with the roster, if there is one, now and whenever a newer one arrives."""
        self._roster_handlers.append(handle)
        if self._exchange is not None:
            handle(self._exchange.roster)

    def handle_timers(self, now_s: float) -> None:
        """Pass on the roster, and renew the session, each when it is due; to be called at least twice a second."""
        if self._exchange is not None:
            self._follow_credentials(self._exchange, now_s)
        self._renew(now_s)

    def _follow_credentials(self, exchange: RosterExchange, now_s: float) -> None:
        if exchange.handle_timers(now_s):
            for handle in self._roster_handlers:
                handle(exchange.roster)
            self.renew_by(now_s + random.SystemRandom().uniform(0.0, _ROSTER_DELAY_S))
        if now_s >= self._certificate_due_s:
            self._certificate_due_s = now_s + _CERTIFICATE_PERIOD_S
            assert self._network.credentials is not None
            version = _version_of(self._network.credentials)
            if version not in (None, self._certificate):
                self._certificate = version
                self.renew_by(now_s)

    def renew_by(self, due_s: float) -> None:
        """Have the session replaced by another one when this is due, or sooner."""
        if self._renewal_due_s is None or due_s < self._renewal_due_s:
            self._renewal_due_s = due_s

    def reopen(self) -> None:
        """Close the session and open another; raises NetworkError, and may be called again then."""
        if self._renewal is not None:
            self._renewal.cancel()
            self.session, self._renewal = self._renewal.session, None
        close_session(self.session)
        self.session = open_session(self._network)
        for user in self._users:
            user.move_to(self.session)()

    def _reopen_router(self, now_s: float) -> None:
        """Reopen the session of a router: its clients know its port alone, and another one serves them meanwhile."""
        try:
            self.reopen()
        except NetworkError as error:
            self._print_line(f"the session cannot be renewed yet: {error}")
            self.renew_by(now_s + _RETRY_S)

    def _renew(self, now_s: float) -> None:
        if self._renewal is not None:
            self._renewal.handle_timers(now_s)
            self.session = self._renewal.session
            if self._renewal.is_done:
                self._renewal = None
        elif self._renewal_due_s is not None and now_s >= self._renewal_due_s:
            self._renewal_due_s = None
            if self._network.role == "router":
                self._reopen_router(now_s)
            else:
                self._renewal = SessionRenewal(
                    self._network, self.session, self._users, self._print_line
                )


def _version_of(folder: Path) -> tuple[int, int] | None:
    """Return what changes when the certificate is replaced; None while its disk is away."""
    try:
        status = (folder / IDENTITY_FILE).stat()
    except OSError:
        return None
    return status.st_mtime_ns, status.st_ino
