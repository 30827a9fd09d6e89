"""A session for a command that ends soon: it has the newest roster of those to whom it is connected.

Otherwise it would be deaf to members that were admitted since it ran last.
"""

import contextlib
import time
from collections.abc import Iterator

from crcolony.transport.close_session import close_session
from crcolony.transport.credentials import load_credentials
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.roster_exchange import RosterExchange
from crcolony.transport.zenoh_session import Session, has_links, open_session

_TIMEOUT_S = 3.0
_ANSWER_S = 2.0
"""So long after it is connected somebody has said which roster it has: loops of others may wait half a second."""
_ADMISSION_S = 4.0
"""So long after a newer roster was published everybody acts by it (`connection.py`)."""
_POLL_S = 0.02


@contextlib.contextmanager
def brief_session(network: NetworkSettings) -> Iterator[Session]:
    """Have a session inside the context; raises NetworkError as `open_session` does."""
    session = open_session(network)
    try:
        if network.credentials is not None and _exchange_rosters(network, session):
            close_session(session)
            session = open_session(network)
        yield session
    finally:
        close_session(session)


def _exchange_rosters(network: NetworkSettings, session: Session) -> bool:
    """Return whether a newer roster has arrived, which is in the folder of credentials then.

    If the others had an older one, in which this member may not be yet, wait until they have opened other sessions.
    """
    assert network.credentials is not None
    exchange = RosterExchange(session, load_credentials(network.credentials))
    end_s = time.monotonic() + _TIMEOUT_S
    is_linked = False
    while time.monotonic() < end_s:
        if exchange.handle_timers(time.monotonic()):
            return True
        if exchange.is_agreed:
            break
        if not is_linked and has_links(session):
            is_linked, end_s = True, min(end_s, time.monotonic() + _ANSWER_S)
        time.sleep(_POLL_S)
    if exchange.has_published:
        time.sleep(_ADMISSION_S)
    return False
