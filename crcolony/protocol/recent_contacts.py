"""The contacts of one robot that are recent enough for a mating to begin."""

from collections.abc import Iterator
from dataclasses import dataclass

from crcolony.protocol.encounters import Offer
from crcolony.protocol.identity import RobotId


@dataclass(frozen=True)
class RecentContact:
    """A contact that the robot's own body has reported, and the agent that was in control at that moment."""

    peer: RobotId
    nonce: int
    own: Offer
    tick: int
    propose_at_s: float
    """When this robot proposes, unless the other has proposed before"""
    expires_at_s: float


class RecentContacts:
    """The last contact with every peer, the oldest peer first."""

    def __init__(self) -> None:
        self._contacts: dict[RobotId, RecentContact] = {}

    def __iter__(self) -> Iterator[RecentContact]:
        return iter(tuple(self._contacts.values()))

    def __len__(self) -> int:
        return len(self._contacts)

    def copy(self) -> "RecentContacts":
        """Return an independent copy."""
        other = RecentContacts()
        other._contacts = self._contacts.copy()
        return other

    def add(self, contact: RecentContact) -> None:
        """Replace the last contact with this peer."""
        self._contacts[contact.peer] = contact

    def get(self, peer: RobotId) -> RecentContact | None:
        """Return the last contact with a peer, None if there is no recent one."""
        return self._contacts.get(peer)

    def discard(self, peer: RobotId) -> None:
        """Forget the contact with a peer, if there is one."""
        self._contacts.pop(peer, None)

    def discard_expired(self, now_s: float) -> None:
        """Forget all contacts that are too old for a mating."""
        for contact in self:
            if contact.expires_at_s <= now_s:
                self.discard(contact.peer)

    def due(self, now_s: float) -> list[RecentContact]:
        """Return the contacts after which this robot may propose now, the last peer first."""
        return [c for c in reversed(tuple(self)) if c.propose_at_s <= now_s < c.expires_at_s]
