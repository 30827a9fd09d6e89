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
from crcolony.telemetry.robot_status import RobotStatus
from crcolony.telemetry.status_changes import (
    EventReceived,
    StatusChange,
)

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
        self._backfill = BackfillScheduler(about_period_s)
        self._presence = PresenceTable(self._backfill)
        self.robots, self.arenas = self._presence.robots, self._presence.arenas
        self.samples: Counter[SampleKind] = Counter()
        self.bytes = 0
        self.malformed = 0
        self.stale = 0
        """What was told of lives that are over, or not believed"""

    @property
    def ignored(self) -> int:
        """How often there was no room for somebody."""
        return self._presence.ignored

    @property
    def alive(self) -> list[RobotStatus]:
        """Robots on the network, in order of their number and id."""
        return [status for status in self.all if status.is_alive]

    @property
    def all(self) -> list[RobotStatus]:
        """All robots that are remembered, in order of their number and id."""
        return sorted(
            self.robots.values(), key=lambda w: (w.state.number if w.state else 2**31, w.robot)
        )

    def handle_timeouts(self, unix_s: float) -> None:
        """Forget who is not on the network and has been silent for long."""
        self._presence.remove_silent(unix_s)

    def due_requests(self, unix_s: float) -> list[BackfillRequest]:
        """Return what to ask now; whoever does not ask does not call this."""
        return self._backfill.due_requests(unix_s, self.robots, self.arenas)

    def handle_sample(self, sample: TelemetrySample) -> list[StatusChange]:
        """Take what was heard; return what is new, in the order in which it happened."""
        self.samples[sample.kind] += 1
        self.bytes += len(sample.data)
        try:
            match sample.kind:
                case "alive":
                    return self._presence.handle_token_declared(sample.key, _unix_s(sample))
                case "gone":
                    return self._presence.handle_token_undeclared(sample.key, _unix_s(sample))
                case "state":
                    return self._take_state(sample)
                case "event":
                    colony, robot = _robot_of(sample)
                    return self._take_told(robot, colony, sample.data, _unix_s(sample))
                case "scene":
                    return self._take_scene(sample)
                case "history":
                    return self._take_past(sample)
                case "metadata":
                    return self._take_about(sample)
        except WireError:
            self.malformed += 1
        return []

    # What they tell ------------------------------------------------------------------------------------------------

    def _take_state(self, sample: TelemetrySample) -> list[StatusChange]:
        colony, robot = _robot_of(sample)
        state = decode_state(sample.data)
        _demand(state.robot == robot)
        unix_s = _unix_s(sample)
        status = self._presence.robot(robot, colony, unix_s)
        if status is None:
            return []
        changes = self._presence.start_incarnation(status, state.incarnation)
        if state.incarnation != status.incarnation:
            self.stale += 1
            return changes
        status.state, status.updated_s = state, unix_s
        sequence = status.track_events(state.seq, self._history)
        sequence.announce_up_to(state.seq, unix_s)
        if sequence.missing:
            self._backfill.request_history(robot)
        return changes

    def _take_told(
        self, robot: RobotId, colony: str, data: bytes, unix_s: float
    ) -> list[StatusChange]:
        message = decode_event(data)
        _demand(message.robot == robot and message.seq > 0)
        status = self._presence.robot(robot, colony, unix_s)
        if status is None:
            return []
        changes = self._presence.start_incarnation(status, message.incarnation)
        if message.incarnation != status.incarnation:
            is_new = status.fill(message)
            self.stale += not is_new
        else:
            sequence = status.track_events(message.seq - 1, self._history)
            is_new = sequence.record(message.seq, unix_s)
            if sequence.missing:
                self._backfill.request_history(robot)
        return [*changes, EventReceived(message)] if is_new else changes

    def _take_scene(self, sample: TelemetrySample) -> list[StatusChange]:
        scene = decode_scene(sample.data)
        _demand(scene.arena == key_expressions.parse_arena_topic(sample.key, "scene"))
        arena = self._presence.arena(scene.arena, _unix_s(sample))
        if arena is not None:
            arena.scene, arena.updated_s = scene, _unix_s(sample)
        return []

    # What they answer ----------------------------------------------------------------------------------------------

    def _take_past(self, sample: TelemetrySample) -> list[StatusChange]:
        colony, robot = _robot_of(sample)
        past = decode_history_reply(sample.data)
        changes: list[StatusChange] = []
        for data in past.events:
            try:
                changes += self._take_told(robot, colony, data, _unix_s(sample))
            except WireError:
                self.malformed += 1
        status = self.robots.get(robot)
        asked = self._backfill.complete(robot, "history")
        if status is None or status.sequence is None or past.incarnation != status.incarnation:
            return changes
        status.sequence.drop_before(past.oldest)
        if asked is not None and asked.incarnation == past.incarnation:
            status.sequence.handle_reply(asked.first, is_empty=not past.events)
        return changes

    def _take_about(self, sample: TelemetrySample) -> list[StatusChange]:
        if key_expressions.parse_arena_topic(sample.key, "metadata") is not None:
            return self._take_about_arena(sample)
        colony, robot = _robot_of(sample)
        about = decode_robot_metadata(sample.data)
        _demand(about.robot == robot and _are_settings(about.settings))
        status = self._presence.robot(robot, colony, _unix_s(sample))
        if status is None:
            return []
        changes = self._presence.start_incarnation(status, about.incarnation)
        if about.incarnation != status.incarnation:
            self.stale += 1
        else:
            status.metadata = about
            self._backfill.complete(robot, "metadata")
        return changes

    def _take_about_arena(self, sample: TelemetrySample) -> list[StatusChange]:
        about = decode_arena_metadata(sample.data)
        _demand(about.arena == key_expressions.parse_arena_topic(sample.key, "metadata"))
        _demand(_are_settings(about.settings))
        arena = self._presence.arena(about.arena, _unix_s(sample))
        if arena is not None:
            arena.metadata = about
            self._backfill.complete(about.arena, "metadata")
        return []


def _unix_s(sample: TelemetrySample) -> float:
    return sample.unix_ms / 1000.0


def _robot_of(sample: TelemetrySample) -> tuple[str, RobotId]:
    """Return the colony and the robot that a key names; raises WireError if it names none."""
    named = key_expressions.parse_robot_topic(sample.key, sample.kind)
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
