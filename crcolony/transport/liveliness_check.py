"""Finds connected peers whose liveliness token never arrived.

In meshes of a hundred processes that start at once, Zenoh was observed to lose tokens for good though every link was
up. Every process of ours has a token that names its session, so a connected peer without one is such a case, or another
Zenoh program. This is only reported: `LinkRecovery` has better evidence before a robot reconnects.
"""

import threading

import zenoh
from zenoh.handlers import Callback

from crcolony.protocol.key_expressions import ROOT

_PERIOD_S = 5.0
"""How often the tokens are queried."""
_TIMEOUT_S = 15.0
"""A peer that has no token for this long is reported."""


class LivelinessCheck:
    """Compares at intervals the peers of a session with the tokens that it receives. Nothing here blocks."""

    def __init__(self, session: zenoh.Session) -> None:
        self._session = session
        self._lock = threading.Lock()
        self._with_token: set[str] = set()
        """Sessions whose tokens have arrived since the last query"""
        self._missing: dict[str, float] = {}
        """Peers without a token, and since when"""
        self._reported: set[str] = set()
        self._due_s = 0.0

    def find_missing(self, now_s: float) -> list[str]:
        """Return the sessions of peers that have had no token for too long, each once."""
        if now_s < self._due_s:
            return []
        is_first = self._due_s == 0.0
        self._due_s = now_s + _PERIOD_S
        with self._lock:
            with_token, self._with_token = self._with_token, set()
        peers = {str(peer) for peer in self._session.info.peers_zid()}
        self._session.liveliness().get(
            f"{ROOT}/**", Callback(self._on_token, indirect=False), timeout=_PERIOD_S
        )
        if is_first:  # there was no query before
            return []
        self._missing = {peer: self._missing.get(peer, now_s) for peer in peers - with_token}
        late = [peer for peer, at_s in self._missing.items() if now_s - at_s >= _TIMEOUT_S]
        new = [peer for peer in late if peer not in self._reported]
        self._reported = set(late)
        return new

    def _on_token(self, reply: zenoh.Reply) -> None:
        if reply.ok is not None:
            with self._lock:
                self._with_token.add(str(reply.ok.key_expr).rpartition("/")[2])
