"""What a responder remembers for good of every initiator (PROTOCOL.md, "Rules", marks)."""

from collections.abc import Mapping

from crcolony.protocol.identity import RobotId
from crcolony.protocol.mating_messages import Encounter

Marks = Mapping[RobotId, tuple[tuple[int, int], bool]]
"""By initiator the number of the last encounter that was prepared, and whether it became a mating."""


class ResponderMarks:
    """By initiator the number of the last encounter that was prepared, and of the last that became a mating."""

    def __init__(self, max_peers: int) -> None:
        self._max_peers = max_peers
        self.prepared: dict[RobotId, tuple[int, int]] = {}
        self.mated: dict[RobotId, tuple[int, int]] = {}

    def copy(self) -> "ResponderMarks":
        """Return an independent copy."""
        other = ResponderMarks(self._max_peers)
        other.prepared, other.mated = self.prepared.copy(), self.mated.copy()
        return other

    def restore(self, marks: Marks) -> None:
        """Restore from disk the last number of every initiator, and whether that encounter became a mating."""
        for peer, (number, has_mated) in marks.items():
            self.prepared[peer] = number
            if has_mated:
                self.mated[peer] = number

    def is_stale(self, encounter: Encounter) -> bool:
        """Return whether an encounter is not newer than all that this robot was prepared for by its initiator."""
        return encounter.number <= self.prepared.get(encounter.initiator, (-1, -1))

    def is_mated(self, encounter: Encounter) -> bool:
        """Return whether an encounter is the last mating with its initiator."""
        return self.mated.get(encounter.initiator) == encounter.number

    def has_room_for(self, peer: RobotId) -> bool:
        """Return whether a number of this initiator can be remembered."""
        return peer in self.prepared or len(self.prepared) < self._max_peers

    def add_prepared(self, encounter: Encounter) -> None:
        """Remember that this robot is prepared for an encounter."""
        self.prepared[encounter.initiator] = encounter.number

    def add_mated(self, encounter: Encounter) -> None:
        """Remember that an encounter became a mating."""
        self.mated[encounter.initiator] = encounter.number
