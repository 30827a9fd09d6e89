"""What a watcher knows of one robot, and of one arena."""

from dataclasses import dataclass, field

from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import (
    ArenaMetadata,
    EventMessage,
    RobotMetadata,
    RobotState,
    Scene,
)
from crcolony.telemetry.sequence_gaps import SequenceTracker


@dataclass
class RobotStatus:
    """One robot, as it was last heard of."""

    robot: RobotId
    colony: str
    incarnations: dict[tuple[int, str], None] = field(default_factory=dict)
    """Life and session of its tokens on the network"""
    state: RobotState | None = None
    updated_s: float = 0.0
    """When the state came, unix seconds"""
    restarts: int = 0
    """Lives that it has begun while it was watched"""
    metadata: RobotMetadata | None = None
    """Of an earlier life until it has answered in this one"""
    incarnation: int = -1
    """The newest that was heard of"""
    sequence: SequenceTracker | None = None
    """In the events of that life; None before anything was heard of them"""
    _older: tuple[int, SequenceTracker] | None = None
    """The life before, as long as its events may still come"""
    _missed_before: int = 0
    """In lives before that"""

    @property
    def is_alive(self) -> bool:
        """Whether it is on the network."""
        return bool(self.incarnations)

    @property
    def missed(self) -> int:
        """How many of its events have not come, though they were told while it was watched."""
        older = self._older[1].missed if self._older is not None else 0
        return (
            self._missed_before + older + (self.sequence.missed if self.sequence is not None else 0)
        )

    def start_incarnation(self, incarnation: int) -> None:
        """Hear of a newer life."""
        if self.sequence is not None:
            self.sequence.close()
            if self._older is not None:
                self._missed_before += self._older[1].missed
            self._older = self.incarnation, self.sequence
        self.incarnation, self.sequence = incarnation, None

    def track_events(self, seen: int, history: int) -> SequenceTracker:
        """Return the gaps of the present life; `seen` is the last event so far if nothing was heard of it yet."""
        if self.sequence is None:
            self.sequence = SequenceTracker(seen, history)
        return self.sequence

    def fill(self, message: EventMessage) -> bool:
        """Take an event of an older life; tell whether it is one that was known to be missing."""
        if self._older is None or self._older[0] != message.incarnation:
            return False
        return self._older[1].fill_gap(message.seq)


@dataclass
class ArenaStatus:
    """One arena, as it was last heard of."""

    name: str
    sessions: dict[tuple[int, str], None] = field(default_factory=dict)
    """World and session of its tokens on the network"""
    scene: Scene | None = None
    updated_s: float = 0.0
    """When the scene came, unix seconds"""
    metadata: ArenaMetadata | None = None
    """Of an earlier world until it has answered in this one"""
    arena_run: int | None = None
    """That of its newest token"""

    @property
    def is_alive(self) -> bool:
        """Whether it is on the network."""
        return bool(self.sessions)
