"""Who is on the network, and who was heard of: bounded, since anybody can make up names there."""

from collections.abc import Callable
from typing import Generic, TypeVar

from crcolony.protocol import key_expressions
from crcolony.protocol.codec import WireError
from crcolony.protocol.identity import RobotId
from crcolony.telemetry.backfill import BackfillScheduler
from crcolony.telemetry.robot_status import ArenaStatus, RobotStatus
from crcolony.telemetry.status_changes import (
    ArenaJoined,
    ArenaLeft,
    RobotJoined,
    RobotLeft,
    RobotRestarted,
    StatusChange,
)

MAX_ROBOTS, MAX_ARENAS, _MAX_TOKENS = 10_000, 1_000, 100
"""That are remembered; tokens of each"""
FORGET_S = 600.0
"""Who is not on the network and has said nothing for so long is forgotten."""

Name = TypeVar("Name")
Entry = TypeVar("Entry")


class BoundedRegistry(Generic[Name, Entry]):
    """Entries by name, at most so many. Who is not present makes room for others, the longest silent first.

    `forgotten` hears who has been forgotten.
    """

    def __init__(self, most: int, forgotten: Callable[[Name], None] = lambda name: None) -> None:
        self.entries: dict[Name, Entry] = {}
        self._most, self._forgotten = most, forgotten
        self._absent: dict[Name, float] = {}
        """When each was heard last (s), the longest silent first"""

    def get_or_create(self, name: Name, now_s: float, make: Callable[[], Entry]) -> Entry | None:
        """Return the entry of somebody who is heard now, a new one at need; None if there is no room for it."""
        entry = self.entries.get(name)
        if entry is None:
            if len(self.entries) >= self._most and not self._forget_one():
                return None
            entry = self.entries[name] = make()
            self._absent[name] = now_s
        elif self._absent.pop(name, None) is not None:
            self._absent[name] = now_s
        return entry

    def mark_present(self, name: Name) -> None:
        """Hear that somebody is present, and keep the entry while that is so."""
        self._absent.pop(name, None)

    def mark_absent(self, name: Name, now_s: float) -> None:
        """Hear that somebody is present no more."""
        self._absent[name] = now_s

    def remove_absent_before(self, before_s: float) -> None:
        """Forget all who are not present and have said nothing since a time."""
        while self._absent and next(iter(self._absent.values())) < before_s:
            self._forget_one()

    def _forget_one(self) -> bool:
        name = next(iter(self._absent), None)
        if name is None:
            return False
        del self._absent[name], self.entries[name]
        self._forgotten(name)
        return True


class PresenceTable:
    """Robots and arenas, by their tokens and by what was heard of them; `asking` learns whom to ask about."""

    def __init__(self, backfill: BackfillScheduler) -> None:
        self._backfill = backfill
        self._robots = BoundedRegistry[RobotId, RobotStatus](MAX_ROBOTS, backfill.forget)
        self._arenas = BoundedRegistry[str, ArenaStatus](MAX_ARENAS, backfill.forget)
        self.robots, self.arenas = self._robots.entries, self._arenas.entries
        self.ignored = 0
        """How often there was no room for somebody, or for a token"""

    def remove_silent(self, unix_s: float) -> None:
        """Forget who is not on the network and has been silent for long."""
        self._robots.remove_absent_before(unix_s - FORGET_S)
        self._arenas.remove_absent_before(unix_s - FORGET_S)

    def robot(self, robot: RobotId, colony: str, unix_s: float) -> RobotStatus | None:
        """Return a robot that is heard now; None if there is no room for it."""
        status = self._robots.get_or_create(robot, unix_s, lambda: RobotStatus(robot, colony))
        self.ignored += status is None
        return status

    def arena(self, name: str, unix_s: float) -> ArenaStatus | None:
        """Return an arena that is heard now; None if there is no room for it."""
        arena = self._arenas.get_or_create(name, unix_s, lambda: ArenaStatus(name))
        self.ignored += arena is None
        return arena

    def start_incarnation(self, status: RobotStatus, incarnation: int) -> list[StatusChange]:
        """Hear of a robot's life; return what is new in that.

        While it is on the network only a life that has a token is believed: it comes onto the network before it tells
        anything, and a lie about a life to come would make everybody deaf to the present one.
        """
        if incarnation <= status.incarnation or (
            status.incarnations and incarnation > max(status.incarnations)[0]
        ):
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

    def handle_token_declared(self, key: str, unix_s: float) -> list[StatusChange]:
        """Take a token that has come; raises WireError if it is none."""
        robot, arena = (
            key_expressions.parse_robot_token(key),
            key_expressions.parse_arena_token(key),
        )
        if robot is not None:
            return self._robot_appears(robot, unix_s)
        if arena is not None:
            return self._arena_appears(arena, unix_s)
        raise WireError("not a token")

    def _robot_appears(
        self, token: key_expressions.RobotToken, unix_s: float
    ) -> list[StatusChange]:
        status = self.robot(token.robot, token.colony, unix_s)
        if status is None or not self._has_room(status.incarnations):
            return []
        was_alive, status.colony = status.is_alive, token.colony
        status.incarnations[token.incarnation, token.session] = None
        self._robots.mark_present(token.robot)
        changes: list[StatusChange] = [] if was_alive else [RobotJoined(token.robot)]
        changes += self.start_incarnation(status, token.incarnation)
        if status.metadata is None or status.metadata.incarnation != status.incarnation:
            self._backfill.request_metadata(token.robot)
        return changes

    def _arena_appears(
        self, token: key_expressions.ArenaToken, unix_s: float
    ) -> list[StatusChange]:
        arena = self.arena(token.arena, unix_s)
        if arena is None or not self._has_room(arena.sessions):
            return []
        was_alive, was_world = arena.is_alive, arena.arena_run
        arena.sessions[token.arena_run, token.session] = None
        arena.arena_run = token.arena_run
        self._arenas.mark_present(token.arena)
        if token.arena_run != was_world:
            self._backfill.request_metadata(token.arena)
        return [] if was_alive else [ArenaJoined(token.arena)]

    def handle_token_undeclared(self, key: str, unix_s: float) -> list[StatusChange]:
        """Take a token that has gone; raises WireError if it was none."""
        robot, arena = (
            key_expressions.parse_robot_token(key),
            key_expressions.parse_arena_token(key),
        )
        if robot is not None:
            status = self.robots.get(robot.robot)
            if status is not None and _lose(
                status.incarnations, (robot.incarnation, robot.session)
            ):
                self._robots.mark_absent(robot.robot, unix_s)
                return [RobotLeft(robot.robot)]
        elif arena is not None:
            seen = self.arenas.get(arena.arena)
            if seen is not None and _lose(seen.sessions, (arena.arena_run, arena.session)):
                self._arenas.mark_absent(arena.arena, unix_s)
                return [ArenaLeft(arena.arena)]
        else:
            raise WireError("not a token")
        return []

    def _has_room(self, tokens: dict[tuple[int, str], None]) -> bool:
        has_room = len(tokens) < _MAX_TOKENS
        self.ignored += not has_room
        return has_room


def _lose(tokens: dict[tuple[int, str], None], token: tuple[int, str]) -> bool:
    """Remove a token; tell whether it was there, and the last."""
    was_there = token in tokens
    tokens.pop(token, None)
    return was_there and not tokens
