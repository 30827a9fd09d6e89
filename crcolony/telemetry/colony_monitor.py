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
    decode_about_arena,
    decode_about_robot,
    decode_past,
    decode_scene,
    decode_state,
    decode_told,
)
from crcolony.telemetry.backfill import Asking, Question
from crcolony.telemetry.presence import Census
from crcolony.telemetry.robot_status import Watched, WatchedArena
from crcolony.telemetry.status_changes import (
    Appeared,
    ArenaAppeared,
    ArenaVanished,
    Happened,
    News,
    Restarted,
    Vanished,
)

__all__ = [
    "Appeared",
    "ArenaAppeared",
    "ArenaVanished",
    "Happened",
    "Heard",
    "Kind",
    "News",
    "Question",
    "Restarted",
    "Vanished",
    "Watch",
    "Watched",
    "WatchedArena",
]

Kind = Literal["alive", "gone", "state", "event", "scene", "past", "about"]
_settings = msgspec.json.Decoder(dict[str, dict[str, Any]])


class Heard(NamedTuple):
    """Something that came from the network, as it came, and when."""

    kind: Kind
    """`alive` and `gone` are tokens (without data), `past` and `about` answers to questions"""
    key: str
    data: bytes
    unix_ms: int


class Watch:
    """Takes what is heard, keeps the latest, tells what is new, and knows what to ask for.

    `history` is how many events it wants of those that a robot's life had before it was heard of; `about_period_s` is
    how often some robots are asked what they are like and whom they see.
    """

    def __init__(self, *, history: int = 0, about_period_s: float = 10.0) -> None:
        self._history = history
        self._asking = Asking(about_period_s)
        self._census = Census(self._asking)
        self.robots, self.arenas = self._census.robots, self._census.arenas
        self.messages: Counter[Kind] = Counter()
        self.bytes = 0
        self.malformed = 0
        self.stale = 0
        """What was told of lives that are over, or not believed"""

    @property
    def ignored(self) -> int:
        """How often there was no room for somebody."""
        return self._census.ignored

    @property
    def alive(self) -> list[Watched]:
        """Robots on the network, in order of their number and id."""
        return [watched for watched in self.all if watched.is_alive]

    @property
    def all(self) -> list[Watched]:
        """All robots that are remembered, in order of their number and id."""
        return sorted(
            self.robots.values(), key=lambda w: (w.state.number if w.state else 2**31, w.robot)
        )

    def let_time_pass(self, unix_s: float) -> None:
        """Forget who is not on the network and has been silent for long."""
        self._census.forget(unix_s)

    def questions(self, unix_s: float) -> list[Question]:
        """Return what to ask now; whoever does not ask does not call this."""
        return self._asking.questions(unix_s, self.robots, self.arenas)

    def take(self, heard: Heard) -> list[News]:
        """Take what was heard; return what is new, in the order in which it happened."""
        self.messages[heard.kind] += 1
        self.bytes += len(heard.data)
        try:
            match heard.kind:
                case "alive":
                    return self._census.appear(heard.key, _unix_s(heard))
                case "gone":
                    return self._census.vanish(heard.key, _unix_s(heard))
                case "state":
                    return self._take_state(heard)
                case "event":
                    colony, robot = _robot_of(heard)
                    return self._take_told(robot, colony, heard.data, _unix_s(heard))
                case "scene":
                    return self._take_scene(heard)
                case "past":
                    return self._take_past(heard)
                case "about":
                    return self._take_about(heard)
        except WireError:
            self.malformed += 1
        return []

    # What they tell ------------------------------------------------------------------------------------------------

    def _take_state(self, heard: Heard) -> list[News]:
        colony, robot = _robot_of(heard)
        state = decode_state(heard.data)
        _demand(state.robot == robot)
        unix_s = _unix_s(heard)
        watched = self._census.robot(robot, colony, unix_s)
        if watched is None:
            return []
        news = self._census.begin_life(watched, state.life)
        if state.life != watched.life:
            self.stale += 1
            return news
        watched.state, watched.heard_s = state, unix_s
        gaps = watched.follow(state.seq, self._history)
        gaps.reveal(state.seq, unix_s)
        if gaps.missing:
            self._asking.want_past(robot)
        return news

    def _take_told(self, robot: RobotId, colony: str, data: bytes, unix_s: float) -> list[News]:
        told = decode_told(data)
        _demand(told.robot == robot and told.seq > 0)
        watched = self._census.robot(robot, colony, unix_s)
        if watched is None:
            return []
        news = self._census.begin_life(watched, told.life)
        if told.life != watched.life:
            is_new = watched.fill(told)
            self.stale += not is_new
        else:
            gaps = watched.follow(told.seq - 1, self._history)
            is_new = gaps.take(told.seq, unix_s)
            if gaps.missing:
                self._asking.want_past(robot)
        return [*news, Happened(told)] if is_new else news

    def _take_scene(self, heard: Heard) -> list[News]:
        scene = decode_scene(heard.data)
        _demand(scene.arena == key_expressions.arena_topic(heard.key, "scene"))
        arena = self._census.arena(scene.arena, _unix_s(heard))
        if arena is not None:
            arena.scene, arena.heard_s = scene, _unix_s(heard)
        return []

    # What they answer ----------------------------------------------------------------------------------------------

    def _take_past(self, heard: Heard) -> list[News]:
        colony, robot = _robot_of(heard)
        past = decode_past(heard.data)
        news: list[News] = []
        for data in past.events:
            try:
                news += self._take_told(robot, colony, data, _unix_s(heard))
            except WireError:
                self.malformed += 1
        watched = self.robots.get(robot)
        asked = self._asking.answered(robot, "past")
        if watched is None or watched.gaps is None or past.life != watched.life:
            return news
        watched.gaps.forget_before(past.oldest)
        if asked is not None and asked.life == past.life:
            watched.gaps.answered(asked.first, is_empty=not past.events)
        return news

    def _take_about(self, heard: Heard) -> list[News]:
        if key_expressions.arena_topic(heard.key, "about") is not None:
            return self._take_about_arena(heard)
        colony, robot = _robot_of(heard)
        about = decode_about_robot(heard.data)
        _demand(about.robot == robot and _are_settings(about.settings))
        watched = self._census.robot(robot, colony, _unix_s(heard))
        if watched is None:
            return []
        news = self._census.begin_life(watched, about.life)
        if about.life != watched.life:
            self.stale += 1
        else:
            watched.about = about
            self._asking.answered(robot, "about")
        return news

    def _take_about_arena(self, heard: Heard) -> list[News]:
        about = decode_about_arena(heard.data)
        _demand(about.arena == key_expressions.arena_topic(heard.key, "about"))
        _demand(_are_settings(about.settings))
        arena = self._census.arena(about.arena, _unix_s(heard))
        if arena is not None:
            arena.about = about
            self._asking.answered(about.arena, "about")
        return []


def _unix_s(heard: Heard) -> float:
    return heard.unix_ms / 1000.0


def _robot_of(heard: Heard) -> tuple[str, RobotId]:
    """Return the colony and the robot that a key names; raises WireError if it names none."""
    named = key_expressions.robot_topic(heard.key, heard.kind)
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
