"""What a watcher asks, whom and when: few questions at a time, none for ever. No I/O and no clock."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple

from crcolony.protocol.codec import encode
from crcolony.protocol.identity import RobotId
from crcolony.protocol.key_expressions import ArenaKeys, ColonyKeys
from crcolony.protocol.telemetry_messages import HistoryRequest
from crcolony.telemetry.robot_status import ArenaStatus, RobotStatus
from crcolony.telemetry.sequence_gaps import TRIES

ANSWER_S = 2.0
"""A question that is not answered so soon is asked again, or given up."""
MAX_UNDER_WAY, _MAX_ABOUT = 20, 10
"""Questions at a time, and how many of these may be about robots and arenas: who does not answer blocks a place."""
TURN_ROBOTS = 32
"""So many robots are asked about in every period, in turn."""

Who = RobotId | str
"""A robot, or an arena by its name"""


class BackfillRequest(NamedTuple):
    """What to ask on the network: for missed events (an encoded `HistoryRequest`), or about a robot or arena (nothing)."""

    key: str
    payload: bytes

    @property
    def kind(self) -> Literal["history", "metadata"]:
        """What the answer is."""
        return "history" if self.payload else "metadata"


@dataclass(frozen=True)
class PendingRequest:
    """A question that waits for its answer."""

    asked_s: float
    kind: Literal["history", "metadata"]
    incarnation: int = 0
    first: int = 0
    """Of the events that were asked for"""
    tries: int = 0
    """How often it has been asked about in vain"""


class BackfillScheduler:
    """Remembers who misses what, and lets ask for it; at most one question to everybody at a time."""

    def __init__(self, about_period_s: float) -> None:
        self._about_period_s = about_period_s
        self._past: dict[RobotId, None] = {}
        """Robots of whose events some are missing, the longest unasked first"""
        self._about: dict[Who, int] = {}
        """Who is to be asked about, and how often that was in vain"""
        self._under_way: dict[Who, PendingRequest] = {}
        self._turn_due_s = 0.0
        self._turn = 0

    def request_history(self, robot: RobotId) -> None:
        """Events of a robot are missing."""
        self._past.setdefault(robot)

    def request_metadata(self, who: Who) -> None:
        """A robot has a new life, or an arena a new world."""
        self._about[who] = 0

    def forget(self, who: Who) -> None:
        """Ask somebody nothing any more."""
        self._about.pop(who, None)
        self._under_way.pop(who, None)
        if isinstance(who, bytes):
            self._past.pop(who, None)

    def complete(self, who: Who, kind: Literal["history", "metadata"]) -> PendingRequest | None:
        """Hear an answer; return the question that it answers, if there is one."""
        if kind == "metadata":
            self._about.pop(who, None)
        asked = self._under_way.get(who)
        return self._under_way.pop(who) if asked is not None and asked.kind == kind else None

    def due_requests(
        self,
        unix_s: float,
        robots: Mapping[RobotId, RobotStatus],
        arenas: Mapping[str, ArenaStatus],
    ) -> list[BackfillRequest]:
        """Return what to ask now."""
        self._give_up(unix_s, robots)
        self._take_turns(unix_s, robots)
        return [*self._abouts(unix_s, robots, arenas), *self._pasts(unix_s, robots)]

    def _give_up(self, unix_s: float, robots: Mapping[RobotId, RobotStatus]) -> None:
        """Wait no longer for answers that are late (or from the future: the clock was set back)."""
        for who, asked in list(self._under_way.items()):
            if 0.0 <= unix_s - asked.asked_s < ANSWER_S:
                continue
            del self._under_way[who]
            if asked.kind == "metadata":
                if asked.tries + 1 < TRIES:
                    self._about.setdefault(who, asked.tries + 1)
            elif isinstance(who, bytes):
                status = robots[who]
                if status.sequence is not None and status.incarnation == asked.incarnation:
                    status.sequence.handle_no_reply(asked.first)

    def _take_turns(self, unix_s: float, robots: Mapping[RobotId, RobotStatus]) -> None:
        """In every period the next robots are asked about again."""
        if 0.0 < self._turn_due_s - unix_s <= self._about_period_s:
            return
        self._turn_due_s = unix_s + self._about_period_s
        alive = [robot for robot, status in robots.items() if status.is_alive]
        for place in range(self._turn, self._turn + min(TURN_ROBOTS, len(alive))):
            self._about.setdefault(alive[place % len(alive)], 0)
        self._turn = (self._turn + TURN_ROBOTS) % max(len(alive), 1)

    def _abouts(
        self,
        unix_s: float,
        robots: Mapping[RobotId, RobotStatus],
        arenas: Mapping[str, ArenaStatus],
    ) -> list[BackfillRequest]:
        asked: list[BackfillRequest] = []
        room = _MAX_ABOUT - sum(way.kind == "metadata" for way in self._under_way.values())
        for who in list(self._about):
            if len(asked) >= room or len(self._under_way) >= MAX_UNDER_WAY:
                break
            if who in self._under_way:
                continue
            tries = self._about.pop(who)
            key = _key_about(who, robots, arenas)
            if key is not None:
                self._under_way[who] = PendingRequest(unix_s, "metadata", tries=tries)
                asked.append(BackfillRequest(key, b""))
        return asked

    def _pasts(self, unix_s: float, robots: Mapping[RobotId, RobotStatus]) -> list[BackfillRequest]:
        asked: list[BackfillRequest] = []
        for robot in list(self._past):
            if len(self._under_way) >= MAX_UNDER_WAY:
                break
            status = robots[robot]
            if status.sequence is None or not status.sequence.missing:
                del self._past[robot]
                continue
            first = status.sequence.due(unix_s)
            if first is None or not status.is_alive or robot in self._under_way:
                continue
            self._past[robot] = self._past.pop(robot)
            self._under_way[robot] = PendingRequest(unix_s, "history", status.incarnation, first)
            key = ColonyKeys(status.colony).history(robot)
            asked.append(BackfillRequest(key, encode(HistoryRequest(status.incarnation, first))))
        return asked


def _key_about(
    who: Who, robots: Mapping[RobotId, RobotStatus], arenas: Mapping[str, ArenaStatus]
) -> str | None:
    """Return where to ask about somebody who is on the network."""
    if isinstance(who, str):
        return ArenaKeys(who).metadata if arenas[who].is_alive else None
    status = robots[who]
    return ColonyKeys(status.colony).metadata(who) if status.is_alive else None
