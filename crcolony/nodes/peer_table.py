"""Which robots of the colony are online, and whether another process uses this robot's key."""

import math
from collections.abc import Iterator

from crcolony.protocol.identity import RobotId
from crcolony.protocol.token_set import Token, TokenTable

_DUPLICATE_TIMEOUT_S = 7.0
"""A token of this robot's key that stays longer than two leases belongs to a live process, not to a dead one."""
_STARTUP_S = 10.0
"""Only a token that is online this soon after the start counts as a duplicate: later ones prove nothing."""


class PeerTable:
    """The peers of one robot that are online."""

    def __init__(self, robot: RobotId, incarnation: int) -> None:
        self.session = ""
        """Name of this robot's own session, as in its liveliness token"""
        self._robot, self._incarnation = robot, incarnation
        self._online = TokenTable()
        self._duplicates: dict[Token, float] = {}
        """Older tokens of this robot's own key, and when each came online"""
        self._started_s = math.inf

    def start(self, now_s: float) -> None:
        """Note when this robot started."""
        self._started_s = now_s

    def add(self, now_s: float, peer: RobotId, token: Token) -> bool:
        """Add a token of a peer; return whether the peer was offline before."""
        if peer != self._robot:
            return self._online.add(peer, token)
        if now_s <= self._started_s + _STARTUP_S and token < (self._incarnation, self.session):
            self._duplicates[token] = now_s
        return False

    def remove(self, peer: RobotId, token: Token) -> bool:
        """Remove a token of a peer; return whether the peer is offline now and was online before."""
        if peer == self._robot:
            self._duplicates.pop(token, None)
        return self._online.remove(peer, token)

    def clear(self) -> list[RobotId]:
        """Remove all peers, as a session without peers has been opened; return who was online."""
        peers, self._online = list(self._online), TokenTable()
        return peers

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

    def __contains__(self, peer: RobotId) -> bool:
        return peer in self._online

    def __iter__(self) -> Iterator[RobotId]:
        return iter(self._online)

    def __len__(self) -> int:
        return len(self._online)
