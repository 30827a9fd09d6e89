"""The state of colonies by their telemetry: which robots are online, how they are, and which events are missing.

Samples go in, changes come out. No I/O, no clock, one thread. Anyone can publish anything: malformed samples are
counted, and nothing grows without limit.
"""

from collections import Counter

from crcolony.protocol.identity import RobotId
from crcolony.protocol.settings_changes import settings_changes
from crcolony.protocol.telemetry_messages import (
    ArenaMetadata,
    EventMessage,
    RobotMetadata,
    RobotState,
    Scene,
)
from crcolony.telemetry.backfill import BackfillRequest, BackfillScheduler
from crcolony.telemetry.presence import PresenceTable
from crcolony.telemetry.robot_status import ArenaStatus, RobotStatus
from crcolony.telemetry.samples import (
    ArenaActivitySample,
    ArenaMetadataSample,
    EventSample,
    HistorySample,
    MalformedSample,
    OfflineSample,
    OnlineSample,
    RobotActivitySample,
    RobotMetadataSample,
    SampleKind,
    SceneSample,
    StateSample,
    TelemetrySample,
)
from crcolony.telemetry.status_changes import ArenaChanged, EventReceived, StatusChange


class ColonyMonitor:
    """Handles samples, keeps the latest of each robot and arena, reports changes, and schedules back-fill requests.

    Tokens of other colonies than `colony` (`*`: all) do not arrive. `history` is how many events it requests of those
    that a robot published before it was monitored; `metadata_period_s` is how often the metadata of some robots is
    requested again.
    """

    def __init__(
        self, colony: str = "*", *, history: int = 0, metadata_period_s: float = 10.0
    ) -> None:
        self._colony, self._history = colony, history
        self._backfill = BackfillScheduler(metadata_period_s)
        self._presence = PresenceTable(self._backfill)
        self.samples: Counter[SampleKind] = Counter()
        """How many samples of every kind were handled"""
        self.bytes = 0
        """Of their payloads"""
        self.malformed = 0
        """How many samples and events were malformed"""
        self.stale = 0
        """How many samples and events of other incarnations than the present one were ignored"""

    @property
    def robots(self) -> dict[RobotId, RobotStatus]:
        """All robots that are remembered."""
        return self._presence.robots

    @property
    def arenas(self) -> dict[str, ArenaStatus]:
        """All arenas that are remembered."""
        return self._presence.arenas

    @property
    def ignored(self) -> int:
        """How many samples were ignored since there was no room for their robot, arena or token."""
        return self._presence.ignored

    @property
    def alive(self) -> list[RobotStatus]:
        """Robots that are online, in order of number and id."""
        return [status for status in self.all if status.is_alive]

    @property
    def all(self) -> list[RobotStatus]:
        """All robots that are remembered, in order of number and id."""
        return sorted(
            self.robots.values(),
            key=lambda status: (status.state.number if status.state else 2**31, status.robot),
        )

    def handle_timeouts(self, unix_s: float) -> None:
        """Remove robots and arenas that are offline and have sent nothing for long."""
        self._presence.remove_silent(unix_s)

    def due_requests(self, unix_s: float) -> list[BackfillRequest]:
        """Return the back-fill requests to send now."""
        return self._backfill.due_requests(unix_s, self.robots, self.arenas)

    def handle_sample(self, sample: TelemetrySample) -> list[StatusChange]:
        """Handle a sample; return what has changed, in order."""
        self.samples[sample.kind] += 1
        self.bytes += sample.size_bytes
        match sample:
            case OnlineSample(token=token):
                return self._presence.handle_online(token, sample.unix_s)
            case OfflineSample(token=token):
                return self._presence.handle_offline(token, sample.unix_s)
            case StateSample(colony=colony, state=state):
                return self._handle_state(colony, state, sample.unix_s)
            case EventSample(colony=colony, message=message):
                return self._handle_event(colony, message, sample.unix_s)
            case RobotActivitySample():
                self._handle_robot_activity(sample)
            case ArenaActivitySample():
                self._handle_arena_activity(sample)
            case SceneSample(scene=scene):
                self._handle_scene(scene, sample.unix_s)
            case HistorySample():
                return self._handle_history(sample)
            case RobotMetadataSample(colony=colony, metadata=of_robot):
                return self._handle_robot_metadata(colony, of_robot, sample.unix_s)
            case ArenaMetadataSample(metadata=of_arena):
                return self._handle_arena_metadata(of_arena, sample.unix_s)
            case MalformedSample():
                self.malformed += 1
        return []

    # Publications ----------------------------------------------------------------------------------------------------

    def _handle_state(self, colony: str, state: RobotState, unix_s: float) -> list[StatusChange]:
        status = self._presence.get_robot(state.robot, colony, unix_s)
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
            self._backfill.request_history(state.robot)
        return changes

    def _handle_event(
        self, colony: str, message: EventMessage, unix_s: float
    ) -> list[StatusChange]:
        status = self._presence.get_robot(message.robot, colony, unix_s)
        if status is None:
            return []
        changes = self._presence.start_incarnation(status, message.incarnation)
        if message.incarnation != status.incarnation:
            is_new = status.record_late_event(message)
            self.stale += not is_new
        else:
            sequence = status.track_events(message.seq - 1, self._history)
            is_new = sequence.record(message.seq, unix_s)
            if sequence.missing:
                self._backfill.request_history(message.robot)
        return [*changes, EventReceived(message)] if is_new else changes

    def _handle_scene(self, scene: Scene, unix_s: float) -> None:
        status = self._presence.get_arena(scene.arena, unix_s)
        if status is not None:
            status.scene, status.updated_s = scene, unix_s
            status.without_token = {
                body.robot: status.without_token.get(body.robot, unix_s)
                for body in scene.robots
                if self._colony in ("*", body.colony) and not self._is_online(body.robot)
            }

    def _is_online(self, robot: RobotId) -> bool:
        status = self.robots.get(robot)
        return status is not None and status.is_alive

    def _handle_robot_activity(self, sample: RobotActivitySample) -> None:
        status = self._presence.get_robot(sample.robot, sample.colony, sample.unix_s)
        if status is not None:
            status.activity, status.activity_s = sample.activity, sample.unix_s

    def _handle_arena_activity(self, sample: ArenaActivitySample) -> None:
        status = self._presence.get_arena(sample.arena, sample.unix_s)
        if status is not None:
            status.activity, status.activity_s = sample.activity, sample.unix_s

    # Replies ---------------------------------------------------------------------------------------------------------

    def _handle_history(self, reply: HistorySample) -> list[StatusChange]:
        changes: list[StatusChange] = []
        for message in reply.messages:
            changes += self._handle_event(reply.colony, message, reply.unix_s)
        self.malformed += reply.malformed
        status = self.robots.get(reply.robot)
        request = self._backfill.complete(reply.robot, "history")
        if status is None or status.sequence is None or reply.incarnation != status.incarnation:
            return changes
        status.sequence.drop_before(reply.oldest)
        if request is not None and request.incarnation == reply.incarnation:
            status.sequence.handle_reply(request.first, is_empty=reply.is_empty)
        return changes

    def _handle_robot_metadata(
        self, colony: str, metadata: RobotMetadata, unix_s: float
    ) -> list[StatusChange]:
        status = self._presence.get_robot(metadata.robot, colony, unix_s)
        if status is None:
            return []
        changes = self._presence.start_incarnation(status, metadata.incarnation)
        if metadata.incarnation != status.incarnation:
            self.stale += 1
        else:
            status.metadata = metadata
            self._backfill.complete(metadata.robot, "metadata")
        return changes

    def _handle_arena_metadata(self, metadata: ArenaMetadata, unix_s: float) -> list[StatusChange]:
        status = self._presence.get_arena(metadata.arena, unix_s)
        if status is None:
            return []
        before, status.metadata = status.metadata, metadata
        self._backfill.complete(metadata.arena, "metadata")
        if before is None or before.arena_run == metadata.arena_run:
            return []
        changes = settings_changes(before.settings, metadata.settings)
        return [ArenaChanged(metadata.arena, tuple(changes))] if changes else []
