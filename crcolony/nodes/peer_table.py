"""Which robots of the colony are online, and whether another process uses this robot's key."""

import math
from collections.abc import Iterator

from crcolony.protocol.identity import RobotId

_DUPLICATE_TIMEOUT_S = 7.0
"""A token of this robot's key that stays longer than two leases belongs to a live process, not to a dead one."""
_STARTUP_S = 10.0
"""Only a token that is online this soon after the start counts as a duplicate: later ones prove nothing."""


class PeerTable:
    """The peers of one robot, each with the incarnations and sessions in which it is online."""

    def __init__(self, robot: RobotId, incarnation: int) -> None:
        self.session = ""
        """Name of this robot's own session, as in its liveliness token"""
        self._robot, self._incarnation = robot, incarnation
        self._sessions: dict[RobotId, dict[tuple[int, str], None]] = {}
        self._duplicates: dict[tuple[int, str], float] = {}
        """Older incarnations and sessions of this robot's own key, and when each came online"""
        self._started_s = math.inf

    def start(self, now_s: float) -> None:
        """Note when this robot started."""
        self._started_s = now_s

    def add(self, now_s: float, peer: RobotId, incarnation: int, session: str) -> bool:
        """Add a session of a peer; return whether the peer was offline before."""
        if peer == self._robot:
            is_startup = now_s <= self._started_s + _STARTUP_S
            if is_startup and (incarnation, session) < (self._incarnation, self.session):
                self._duplicates[incarnation, session] = now_s
            return False
        was_offline = peer not in self._sessions
        self._sessions.setdefault(peer, {})[incarnation, session] = None
        return was_offline

    def remove(self, peer: RobotId, incarnation: int, session: str) -> bool:
        """Remove a session of a peer; return whether the peer is offline now and was online before."""
        if peer == self._robot:
            self._duplicates.pop((incarnation, session), None)
        sessions = self._sessions.get(peer)
        if sessions is None:
            return False
        sessions.pop((incarnation, session), None)
        if sessions:
            return False
        del self._sessions[peer]
        return True

    @property
    def has_duplicate(self) -> bool:
        """Whether an older process has this robot's key; the token of a dead one goes when its lease expires."""
        return bool(self._duplicates)

    def duplicate_session(self, now_s: float) -> str | None:
        """Return the session of an older process with this robot's key that outlived its lease, or None."""
        for (_, session), online_s in self._duplicates.items():
            if now_s - online_s > _DUPLICATE_TIMEOUT_S:
                return session
        return None

    def sessions(self) -> list[tuple[RobotId, int, str]]:
        """Return peer, incarnation and session of everything that is online."""
        return [
            (peer, incarnation, session)
            for peer, sessions in self._sessions.items()
            for incarnation, session in sessions
        ]

    def __contains__(self, peer: RobotId) -> bool:
        return peer in self._sessions

    def __iter__(self) -> Iterator[RobotId]:
        return iter(self._sessions)

    def __len__(self) -> int:
        return len(self._sessions)
