"""What a monitor knows of one robot, and of one arena."""

from dataclasses import dataclass, field

from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import (
    SILENT_AFTER_S,
    Activity,
    ArenaMetadata,
    EventMessage,
    RobotMetadata,
    RobotState,
    Scene,
)
from crcolony.protocol.token_set import TokenSet
from crcolony.telemetry.event_text import format_activity
from crcolony.telemetry.sequence_gaps import SequenceTracker


@dataclass
class RobotStatus:
    """One robot, by the newest telemetry that was received."""

    robot: RobotId
    colony: str
    tokens: TokenSet = field(default_factory=TokenSet)
    """Incarnation and session of its liveliness tokens"""
    state: RobotState | None = None
    updated_s: float = 0.0
    """When the state arrived, unix seconds"""
    restarts: int = 0
    """Incarnations that have started while it was monitored"""
    activity: Activity | None = None
    """What it does while it has no body"""
    activity_s: float = 0.0
    """When that arrived, unix seconds"""
    metadata: RobotMetadata | None = None
    """Of an earlier incarnation until the robot has replied in this one"""
    incarnation: int = -1
    """The newest that is known"""
    sequence: SequenceTracker | None = None
    """Of the events of that incarnation; None before anything is known of them"""
    _previous: tuple[int, SequenceTracker] | None = None
    """The incarnation before, whose events may still arrive"""
    _missed_before: int = 0
    """Events that were missed in incarnations before that"""

    @property
    def is_alive(self) -> bool:
        """Whether it is online."""
        return self.tokens.is_online

    def doing(self, unix_s: float) -> str:
        """Return what it does without a body; empty if it has one, or has published nothing of it lately."""
        has_body = self.state is not None and bool(self.state.arena)
        is_later = self.updated_s > self.activity_s
        return (
            "" if has_body and is_later else _format_recent(self.activity, self.activity_s, unix_s)
        )

    @property
    def missed(self) -> int:
        """How many events it has published since it was monitored that have not arrived."""
        previous = self._previous[1].missed if self._previous is not None else 0
        current = self.sequence.missed if self.sequence is not None else 0
        return self._missed_before + previous + current

    def start_incarnation(self, incarnation: int) -> None:
        """Start a newer incarnation: its events are numbered from 1 again."""
        if self.sequence is not None:
            self.sequence.close()
            if self._previous is not None:
                self._missed_before += self._previous[1].missed
            self._previous = self.incarnation, self.sequence
        self.incarnation, self.sequence = incarnation, None

    def track_events(self, last: int, history: int) -> SequenceTracker:
        """Return the tracker of the present incarnation; a new one starts after event `last`."""
        if self.sequence is None:
            self.sequence = SequenceTracker(last, history)
        return self.sequence

    def record_late_event(self, message: EventMessage) -> bool:
        """Record an event of an older incarnation; return whether it was known to be missing."""
        if self._previous is None or self._previous[0] != message.incarnation:
            return False
        return self._previous[1].fill_gap(message.seq)


@dataclass
class ArenaStatus:
    """One arena, by the newest telemetry that was received."""

    name: str
    tokens: TokenSet = field(default_factory=TokenSet)
    """Run and session of its liveliness tokens"""
    scene: Scene | None = None
    updated_s: float = 0.0
    """When the scene arrived, unix seconds"""
    metadata: ArenaMetadata | None = None
    """Of an earlier run until the arena has replied in this one"""
    arena_run: int | None = None
    """That of its newest token"""
    activity: Activity | None = None
    """What it does before its run begins"""
    activity_s: float = 0.0
    """When that arrived, unix seconds"""
    without_token: dict[RobotId, float] = field(default_factory=dict)
    """Robots of the scene that are not online, and since when they are seen so"""

    @property
    def is_alive(self) -> bool:
        """Whether it is online."""
        return self.tokens.is_online

    def doing(self, unix_s: float) -> str:
        """Return what it does before its run begins; empty if it is online, or has published nothing of it lately."""
        if self.is_alive:
            return ""
        return _format_recent(self.activity, self.activity_s, unix_s)


def _format_recent(activity: Activity | None, at_s: float, unix_s: float) -> str:
    if activity is None or unix_s - at_s > SILENT_AFTER_S:
        return ""
    return format_activity(activity)
