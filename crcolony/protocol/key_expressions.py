"""The key expressions of the colony on Zenoh. PROTOCOL.md explains each.

Anybody may put anything into a key that others hear: what is read out of one is checked here.
"""

import re
from typing import NamedTuple

from crcolony.protocol.codec import VERSION
from crcolony.protocol.identity import ID_BYTES, RobotId

ROOT = f"crcolony/{VERSION}"


class ColonyKeys:
    """Where the robots of one colony live, meet their letters, and are watched."""

    def __init__(self, colony: str) -> None:
        self._root = f"{ROOT}/colony/{colony}"
        self.all_alive = f"{self._root}/alive/*/*/*"
        self.all_versions = f"crcolony/*/colony/{colony}/alive/*/*/*"
        """Tokens of every version of the protocol"""
        self.all_states = f"{self._root}/state/*"
        self.all_events = f"{self._root}/event/*"

    def alive(self, robot: RobotId, incarnation: int, session: str) -> str:
        """The liveliness token of a robot: its key carries the incarnation and the session."""
        return f"{self._root}/alive/{robot.hex()}/{incarnation}/{session}"

    def inbox(self, robot: RobotId) -> str:
        """A robot's inbox."""
        return f"{self._root}/inbox/{robot.hex()}"

    def state(self, robot: RobotId) -> str:
        """Where a robot publishes its state."""
        return f"{self._root}/state/{robot.hex()}"

    def event(self, robot: RobotId) -> str:
        """Where a robot publishes its events."""
        return f"{self._root}/event/{robot.hex()}"

    def history(self, robot: RobotId) -> str:
        """Where a robot is asked for events that were missed."""
        return f"{self._root}/history/{robot.hex()}"

    def metadata(self, robot: RobotId) -> str:
        """Where a robot is asked what it is like, and whom it sees."""
        return f"{self._root}/metadata/{robot.hex()}"


class ArenaKeys:
    """Where an arena is joined, and where bodies are observed and commanded."""

    def __init__(self, arena: str) -> None:
        self._root = f"{ROOT}/arena/{arena}"
        self.all_alive = f"{self._root}/alive/*/*"
        self.join = f"{self._root}/join"
        self.scene = f"{self._root}/scene"
        self.metadata = f"{self._root}/metadata"
        """Where it is asked what it is like"""
        self.all_actions = f"{self._root}/body/*/action"

    def alive(self, arena_run: int, session: str) -> str:
        """The liveliness token of one run of the arena."""
        return f"{self._root}/alive/{arena_run}/{session}"

    def observation(self, robot: RobotId) -> str:
        """Where a body's observations are published."""
        return f"{self._root}/body/{robot.hex()}/observation"

    def action(self, robot: RobotId) -> str:
        """Where a body is commanded."""
        return f"{self._root}/body/{robot.hex()}/action"


def observer(session: str) -> str:
    """The liveliness token of somebody who only watches."""
    return f"{ROOT}/observer/{session}"


ALL_ROBOTS_ALIVE = f"{ROOT}/colony/*/alive/*/*/*"
ALL_ARENAS_ALIVE = f"{ROOT}/arena/*/alive/*/*"
ALL_SCENES = f"{ROOT}/arena/*/scene"


_LIFE_BELOW, _WORLD_BELOW, _VERSION_BELOW = 2**32, 2**62, 2**32
_NAME = re.compile(r"[A-Za-z0-9_.-]{1,64}")
"""Of a colony, an arena or a session"""


class RobotToken(NamedTuple):
    """What the key of a robot's liveliness token says."""

    colony: str
    robot: RobotId
    incarnation: int
    session: str


class ArenaToken(NamedTuple):
    """What the key of an arena's liveliness token says."""

    arena: str
    arena_run: int
    session: str


def parse_robot_token(key: str) -> RobotToken | None:
    """Return what a robot's token says, or None if it is none."""
    match chunks(key):
        case ["colony", colony, "alive", name, number, session]:
            robot, incarnation = parse_robot_id(name), _number_in(number, _LIFE_BELOW)
            if robot is not None and incarnation is not None and _are_names(colony, session):
                return RobotToken(colony, robot, incarnation, session)
    return None


def parse_arena_token(key: str) -> ArenaToken | None:
    """Return what an arena's token says, or None if it is none."""
    match chunks(key):
        case ["arena", arena, "alive", number, session]:
            arena_run = _number_in(number, _WORLD_BELOW)
            if arena_run is not None and _are_names(arena, session):
                return ArenaToken(arena, arena_run, session)
    return None


def parse_robot_topic(key: str, topic: str) -> tuple[str, RobotId] | None:
    """Return the colony and the robot that a key of this topic (state, event, history, metadata) names, or None."""
    match chunks(key):
        case ["colony", colony, found, name] if found == topic and _are_names(colony):
            robot = parse_robot_id(name)
            return None if robot is None else (colony, robot)
    return None


def parse_arena_topic(key: str, topic: str) -> str | None:
    """Return the arena that a key of this topic (scene, metadata) names, or None."""
    match chunks(key):
        case ["arena", arena, found] if found == topic and _are_names(arena):
            return arena
    return None


def parse_incompatible_peer(key: str) -> tuple[RobotId, int] | None:
    """Return the robot whose token this is and the version of the protocol that it speaks, if it is another one."""
    match key.split("/"):
        case ["crcolony", number, "colony", _, "alive", name, _, _]:
            robot, version = parse_robot_id(name), _number_in(number, _VERSION_BELOW)
            if robot is not None and version not in (None, VERSION):
                return robot, version or 0
    return None


def chunks(key: str) -> list[str]:
    """Return what follows the protocol's root, chunk by chunk."""
    return key.removeprefix(f"{ROOT}/").split("/")


def parse_robot_id(chunk: str) -> RobotId | None:
    """Return the robot that a chunk of a key names, or None if it names none."""
    try:
        robot = bytes.fromhex(chunk)
    except ValueError:
        return None
    return robot if len(robot) == ID_BYTES else None


def _are_names(*chunks: str) -> bool:
    return all(_NAME.fullmatch(chunk) for chunk in chunks)


def _number_in(chunk: str, below: int) -> int | None:
    is_number = chunk.isascii() and chunk.isdigit() and len(chunk) <= len(str(below))
    return int(chunk) if is_number and int(chunk) < below else None
