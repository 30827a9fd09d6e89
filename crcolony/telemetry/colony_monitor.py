"""What a watcher knows of colonies, from their telemetry alone: who is alive, how they are, and what it has missed.

It is told what came from the network, and tells what is new in it. No I/O, no clock, one thread. Anybody can publish
anything: what is malformed is counted, and nothing grows without limit.
"""

from collections import Counter
from typing import Any, Literal, NamedTuple

import msgspec

from crcolony.protocol import key_expressions
from crcolony.protocol.codec import WireError
from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import (
    decode_arena_metadata,
    decode_event,
    decode_history_reply,
    decode_robot_metadata,
    decode_scene,
    decode_state,
)
from crcolony.telemetry.backfill import BackfillRequest, BackfillScheduler
from crcolony.telemetry.presence import PresenceTable
from crcolony.telemetry.robot_status import ArenaStatus, RobotStatus
from crcolony.telemetry.status_changes import (
    ArenaJoined,
    ArenaLeft,
    EventReceived,
    StatusChange,
)

__all__ = [
    "Appeared",
    "ArenaJoined",
    "ArenaLeft",
    "Happened",
    "Heard",
    "SampleKind",
    "News",
    "BackfillRequest",
    "Restarted",
    "Vanished",
    "ColonyMonitor",
    "RobotStatus",
    "ArenaStatus",
]

SampleKind = Literal["alive", "gone", "state", "event", "scene", "history", "metadata"]
_settings = msgspec.json.Decoder(dict[str, dict[str, Any]])


class TelemetrySample(NamedTuple):
    """Something that came from the network, as it came, and when."""

    kind: SampleKind
    """`alive` and `gone` are tokens (without data), `past` and `about` answers to questions"""
    key: str
    data: bytes
    unix_ms: int


class ColonyMonitor:
    """Takes what is heard, keeps the latest, tells what is new, and knows what to ask for.

    `history` is how many events it wants of those that a robot's life had before it was heard of; `about_period_s` is
    how often some robots are asked what they are like and whom they see.
    """

    def __init__(self, *, history: int = 0, about_period_s: float = 10.0) -> None:
        self._history = history
        self._asking = BackfillScheduler(about_period_s)
        self._census = PresenceTable(self._asking)
        self.robots, self.arenas = self._census.robots, self._census.arenas
        self.samples: Counter[SampleKind] = Counter()
        self.bytes = 0
        self.malformed = 0
        self.stale = 0
        """What was told of lives that are over, or not believed"""

    @property
    def ignored(self) -> int:
        """How often there was no room for somebody."""
        return self._census.ignored

    @property
    def alive(self) -> list[RobotStatus]:
        """Robots on the network, in order of their number and id."""
        return [watched for watched in self.all if watched.is_alive]

    @property
    def all(self) -> list[RobotStatus]:
        """All robots that are remembered, in order of their number and id."""
        return sorted(
            self.robots.values(), key=lambda w: (w.state.number if w.state else 2**31, w.robot)
        )

    def handle_timeouts(self, unix_s: float) -> None:
        """Forget who is not on the network and has been silent for long."""
        self._census.remove_silent(unix_s)

    def due_requests(self, unix_s: float) -> list[BackfillRequest]:
        """Return what to ask now; whoever does not ask does not call this."""
        return self._asking.due_requests(unix_s, self.robots, self.arenas)

    def handle_sample(self, heard: TelemetrySample) -> list[StatusChange]:
        """Take what was heard; return what is new, in the order in which it happened."""
        self.samples[heard.kind] += 1
        self.bytes += len(heard.data)
        try:
            match heard.kind:
                case "alive":
                    return self._census.handle_token_declared(heard.key, _unix_s(heard))
                case "gone":
                    return self._census.handle_token_undeclared(heard.key, _unix_s(heard))
                case "state":
                    return self._take_state(heard)
                case "event":
                    colony, robot = _robot_of(heard)
                    return self._take_told(robot, colony, heard.data, _unix_s(heard))
                case "scene":
                    return self._take_scene(heard)
                case "history":
                    return self._take_past(heard)
                case "metadata":
                    return self._take_about(heard)
        except WireError:
            self.malformed += 1
        return []

    # What they tell ------------------------------------------------------------------------------------------------

    def _take_state(self, heard: TelemetrySample) -> list[StatusChange]:
        colony, robot = _robot_of(heard)
        state = decode_state(heard.data)
        _demand(state.robot == robot)
        unix_s = _unix_s(heard)
        watched = self._census.robot(robot, colony, unix_s)
        if watched is None:
            return []
        news = self._census.start_incarnation(watched, state.incarnation)
        if state.incarnation != watched.incarnation:
            self.stale += 1
            return news
        watched.state, watched.updated_s = state, unix_s
        gaps = watched.track_events(state.seq, self._history)
        gaps.announce_up_to(state.seq, unix_s)
        if gaps.missing:
            self._asking.request_history(robot)
        return news

    def _take_told(
        self, robot: RobotId, colony: str, data: bytes, unix_s: float
    ) -> list[StatusChange]:
        told = decode_event(data)
        _demand(told.robot == robot and told.seq > 0)
        watched = self._census.robot(robot, colony, unix_s)
        if watched is None:
            return []
        news = self._census.start_incarnation(watched, told.incarnation)
        if told.incarnation != watched.incarnation:
            is_new = watched.fill(told)
            self.stale += not is_new
        else:
            gaps = watched.track_events(told.seq - 1, self._history)
            is_new = gaps.record(told.seq, unix_s)
            if gaps.missing:
                self._asking.request_history(robot)
        return [*news, EventReceived(told)] if is_new else news

    def _take_scene(self, heard: TelemetrySample) -> list[StatusChange]:
        scene = decode_scene(heard.data)
        _demand(scene.arena == key_expressions.parse_arena_topic(heard.key, "scene"))
        arena = self._census.arena(scene.arena, _unix_s(heard))
        if arena is not None:
            arena.scene, arena.updated_s = scene, _unix_s(heard)
        return []

    # What they answer ----------------------------------------------------------------------------------------------

    def _take_past(self, heard: TelemetrySample) -> list[StatusChange]:
        colony, robot = _robot_of(heard)
        past = decode_history_reply(heard.data)
        news: list[StatusChange] = []
        for data in past.events:
            try:
                news += self._take_told(robot, colony, data, _unix_s(heard))
            except WireError:
                self.malformed += 1
        watched = self.robots.get(robot)
        asked = self._asking.complete(robot, "history")
        if watched is None or watched.sequence is None or past.incarnation != watched.incarnation:
            return news
        watched.sequence.drop_before(past.oldest)
        if asked is not None and asked.incarnation == past.incarnation:
            watched.sequence.handle_reply(asked.first, is_empty=not past.events)
        return news

    def _take_about(self, heard: TelemetrySample) -> list[StatusChange]:
        if key_expressions.parse_arena_topic(heard.key, "metadata") is not None:
            return self._take_about_arena(heard)
        colony, robot = _robot_of(heard)
        about = decode_robot_metadata(heard.data)
        _demand(about.robot == robot and _are_settings(about.settings))
        watched = self._census.robot(robot, colony, _unix_s(heard))
        if watched is None:
            return []
        news = self._census.start_incarnation(watched, about.incarnation)
        if about.incarnation != watched.incarnation:
            self.stale += 1
        else:
            watched.metadata = about
            self._asking.complete(robot, "metadata")
        return news

    def _take_about_arena(self, heard: TelemetrySample) -> list[StatusChange]:
        about = decode_arena_metadata(heard.data)
        _demand(about.arena == key_expressions.parse_arena_topic(heard.key, "metadata"))
        _demand(_are_settings(about.settings))
        arena = self._census.arena(about.arena, _unix_s(heard))
        if arena is not None:
            arena.metadata = about
            self._asking.complete(about.arena, "metadata")
        return []


def _unix_s(heard: TelemetrySample) -> float:
    return heard.unix_ms / 1000.0


def _robot_of(heard: TelemetrySample) -> tuple[str, RobotId]:
    """Return the colony and the robot that a key names; raises WireError if it names none."""
    named = key_expressions.parse_robot_topic(heard.key, heard.kind)
    if named is None:
        raise WireError("a key that names no robot")
    return named


def _demand(is_so: bool) -> None:
    if not is_so:
        raise WireError("a message that says what its key does not")


def _are_settings(text: str) -> bool:
    try:
        _settings.decode(text)
    except (msgspec.DecodeError, RecursionError):
        return False
    return True
