"""The robots and arenas that are online or have published telemetry; bounded, since anyone can publish any name."""

from crcolony.protocol.identity import RobotId
from crcolony.protocol.key_expressions import ArenaToken, RobotToken
from crcolony.telemetry.backfill import BackfillScheduler
from crcolony.telemetry.bounded_registry import BoundedRegistry
from crcolony.telemetry.robot_status import ArenaStatus, RobotStatus
from crcolony.telemetry.status_changes import (
    ArenaJoined,
    ArenaLeft,
    RobotJoined,
    RobotLeft,
    RobotRestarted,
    StatusChange,
)

MAX_ROBOTS = 10_000
"""Robots that are remembered."""
MAX_ARENAS = 1_000
"""Arenas that are remembered."""
FORGET_S = 600.0
"""A robot or an arena that is offline and has sent nothing for so long is removed."""


class PresenceTable:
    """Robots and arenas by their tokens and their telemetry; `backfill` requests the metadata of new ones."""

    def __init__(self, backfill: BackfillScheduler) -> None:
        self._backfill = backfill
        self._robots = BoundedRegistry[RobotId, RobotStatus](MAX_ROBOTS, backfill.cancel)
        self._arenas = BoundedRegistry[str, ArenaStatus](MAX_ARENAS, backfill.cancel)
        self.robots, self.arenas = self._robots.entries, self._arenas.entries
        self.ignored = 0
        """Samples that were ignored since there was no room for their robot, arena or token"""

    def remove_silent(self, unix_s: float) -> None:
        """Remove robots and arenas that are offline and have sent nothing for long."""
        self._robots.remove_absent_before(unix_s - FORGET_S)
        self._arenas.remove_absent_before(unix_s - FORGET_S)

    def get_robot(self, robot: RobotId, colony: str, unix_s: float) -> RobotStatus | None:
        """Return the status of a robot that has sent something now; return None if there is no room for it."""
        status = self._robots.get_or_create(robot, unix_s, lambda: RobotStatus(robot, colony))
        self.ignored += status is None
        return status

    def get_arena(self, name: str, unix_s: float) -> ArenaStatus | None:
        """Return the status of an arena that has sent something now; return None if there is no room for it."""
        status = self._arenas.get_or_create(name, unix_s, lambda: ArenaStatus(name))
        self.ignored += status is None
        return status

    def start_incarnation(self, status: RobotStatus, incarnation: int) -> list[StatusChange]:
        """Start a newer incarnation of a robot, which its signed telemetry names; return what has changed.

        What a token names does not count: anybody can declare one, and a false one of a future incarnation would make
        all messages of the present one stale.
        """
        if incarnation <= status.incarnation:
            return []
        is_first = status.incarnation < 0
        status.start_incarnation(incarnation)
        if status.is_alive:
            self._backfill.request_metadata(status.robot)
        if is_first:
            return []
        status.restarts += 1
        return [RobotRestarted(status.robot, incarnation)]

    # Tokens ----------------------------------------------------------------------------------------------------------

    def handle_online(self, token: RobotToken | ArenaToken, unix_s: float) -> list[StatusChange]:
        """Add a token that was declared; return what has changed."""
        if isinstance(token, RobotToken):
            return self._handle_robot_online(token, unix_s)
        return self._handle_arena_online(token, unix_s)

    def handle_offline(self, token: RobotToken | ArenaToken, unix_s: float) -> list[StatusChange]:
        """Remove a token that was undeclared; return what has changed."""
        if isinstance(token, RobotToken):
            robot = self.robots.get(token.robot)
            if robot is not None and robot.tokens.remove((token.incarnation, token.session)):
                self._robots.mark_absent(token.robot, unix_s)
                return [RobotLeft(token.robot)]
        else:
            arena = self.arenas.get(token.arena)
            if arena is not None and arena.tokens.remove((token.arena_run, token.session)):
                self._arenas.mark_absent(token.arena, unix_s)
                return [ArenaLeft(token.arena)]
        return []

    def _handle_robot_online(self, token: RobotToken, unix_s: float) -> list[StatusChange]:
        status = self.get_robot(token.robot, token.colony, unix_s)
        if status is None:
            return []
        if status.tokens.is_full:
            self.ignored += 1
            return []
        has_joined = status.tokens.add((token.incarnation, token.session))
        status.colony = token.colony
        self._robots.mark_present(token.robot)
        if status.metadata is None or status.metadata.incarnation != status.incarnation:
            self._backfill.request_metadata(token.robot)
        return [RobotJoined(token.robot)] if has_joined else []

    def _handle_arena_online(self, token: ArenaToken, unix_s: float) -> list[StatusChange]:
        status = self.get_arena(token.arena, unix_s)
        if status is None:
            return []
        if status.tokens.is_full:
            self.ignored += 1
            return []
        has_joined = status.tokens.add((token.arena_run, token.session))
        self._arenas.mark_present(token.arena)
        if token.arena_run != status.arena_run:
            status.arena_run = token.arena_run
            self._backfill.request_metadata(token.arena)
        return [ArenaJoined(token.arena)] if has_joined else []
