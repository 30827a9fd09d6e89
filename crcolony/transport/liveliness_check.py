"""Notices a process on the network whose liveliness token never arrived.

In meshes of a hundred that start at once, Zenoh was seen to lose tokens for good though every link was up. Every
process of ours has a token that names its session, so a connected peer without one is such a case, or a stranger: any
Zenoh program may be one. So this is told, and nothing is done about it; a robot that meets one it cannot see has better
evidence (`embodied_robot.py`).
"""

import threading

import zenoh
from zenoh.handlers import Callback

from crcolony.protocol.key_expressions import ROOT

_PERIOD_S = 5.0
_PATIENCE_S = 15.0


class LivelinessCheck:
    """Compares, now and then, the peers of a session with the tokens it can see. Nothing here waits."""

    def __init__(self, session: zenoh.Session) -> None:
        self._session = session
        self._lock = threading.Lock()
        self._seen: set[str] = set()
        self._missing: dict[str, float] = {}
        """Peers without a token, and since when"""
        self._published: set[str] = set()
        self._due_s = 0.0

    def find_missing(self, now_s: float) -> list[str]:
        """Return the peers that have been without a token for too long, each once."""
        if now_s < self._due_s:
            return []
        is_first = self._due_s == 0.0
        self._due_s = now_s + _PERIOD_S
        with self._lock:
            seen, self._seen = self._seen, set()
        peers = {str(peer) for peer in self._session.info.peers_zid()}
        self._session.liveliness().get(
            f"{ROOT}/**", Callback(self._on_token, indirect=False), timeout=_PERIOD_S
        )
        if is_first:  # nothing was asked before
            return []
        self._missing = {peer: self._missing.get(peer, now_s) for peer in peers - seen}
        late = [peer for peer, at_s in self._missing.items() if now_s - at_s >= _PATIENCE_S]
        changes = [peer for peer in late if peer not in self._published]
        self._published = set(late)
        return changes

    def _on_token(self, reply: zenoh.Reply) -> None:
        if reply.ok is not None:
            with self._lock:
                self._seen.add(str(reply.ok.key_expr).rpartition("/")[2])
