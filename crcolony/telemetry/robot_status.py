"""What a watcher knows of one robot, and of one arena."""

from dataclasses import dataclass, field

from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import AboutArena, AboutRobot, Scene, State, Told
from crcolony.telemetry.sequence_gaps import Gaps


@dataclass
class Watched:
    """One robot, as it was last heard of."""

    robot: RobotId
    colony: str
    lives: dict[tuple[int, str], None] = field(default_factory=dict)
    """Life and session of its tokens on the network"""
    state: State | None = None
    heard_s: float = 0.0
    """When the state came, unix seconds"""
    restarts: int = 0
    """Lives that it has begun while it was watched"""
    about: AboutRobot | None = None
    """Of an earlier life until it has answered in this one"""
    life: int = -1
    """The newest that was heard of"""
    gaps: Gaps | None = None
    """In the events of that life; None before anything was heard of them"""
    _older: tuple[int, Gaps] | None = None
    """The life before, as long as its events may still come"""
    _missed_before: int = 0
    """In lives before that"""

    @property
    def is_alive(self) -> bool:
        """Whether it is on the network."""
        return bool(self.lives)

    @property
    def missed(self) -> int:
        """How many of its events have not come, though they were told while it was watched."""
        older = self._older[1].missed if self._older is not None else 0
        return self._missed_before + older + (self.gaps.missed if self.gaps is not None else 0)

    def begin(self, life: int) -> None:
        """Hear of a newer life."""
        if self.gaps is not None:
            self.gaps.end()
            if self._older is not None:
                self._missed_before += self._older[1].missed
            self._older = self.life, self.gaps
        self.life, self.gaps = life, None

    def follow(self, seen: int, history: int) -> Gaps:
        """Return the gaps of the present life; `seen` is the last event so far if nothing was heard of it yet."""
        if self.gaps is None:
            self.gaps = Gaps(seen, history)
        return self.gaps

    def fill(self, told: Told) -> bool:
        """Take an event of an older life; tell whether it is one that was known to be missing."""
        if self._older is None or self._older[0] != told.life:
            return False
        return self._older[1].fill(told.seq)


@dataclass
class WatchedArena:
    """One arena, as it was last heard of."""

    name: str
    sessions: dict[tuple[int, str], None] = field(default_factory=dict)
    """World and session of its tokens on the network"""
    scene: Scene | None = None
    heard_s: float = 0.0
    """When the scene came, unix seconds"""
    about: AboutArena | None = None
    """Of an earlier world until it has answered in this one"""
    world: int | None = None
    """That of its newest token"""

    @property
    def is_alive(self) -> bool:
        """Whether it is on the network."""
        return bool(self.sessions)
