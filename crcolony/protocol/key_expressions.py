"""The key expressions of a colony on Zenoh (PROTOCOL.md, "Keys").

Any peer can declare and publish any key, so the parsers return None for a key that is not well-formed.
"""

import re
from typing import NamedTuple

from crcolony.protocol.codec import VERSION
from crcolony.protocol.identity import ID_BYTES, RobotId
from crcolony.protocol.stop_messages import StopAddress

ROOT = f"crcolony/{VERSION}"


class ColonyKeys:
    """The keys of the robots of one colony."""

    def __init__(self, colony: str) -> None:
        self._root = f"{ROOT}/colony/{colony}"
        self.all_alive = f"{self._root}/alive/*/*/*"
        self.all_versions = f"crcolony/*/colony/{colony}/alive/*/*/*"
        """Tokens of every version of the protocol"""
        self.all_states = f"{self._root}/state/*"
        self.all_events = f"{self._root}/event/*"
        self.all_activities = f"{self._root}/activity/*"
        self.all_inboxes = f"{self._root}/inbox/*"
        self.all_histories = f"{self._root}/history/*"
        self.all_metadata = f"{self._root}/metadata/*"
        self.stand_in = f"{self._root}/alive/*/0/*"
        """Tokens that a bridge declares for robots: of an older incarnation than any of their own"""

    def alive(self, robot: RobotId, incarnation: int, session: str) -> str:
        """Return the key of a robot's liveliness token."""
        return f"{self._root}/alive/{robot.hex()}/{incarnation}/{session}"

    def alive_of(self, robot: RobotId) -> str:
        """Return the key expression of all liveliness tokens of a robot."""
        return f"{self._root}/alive/{robot.hex()}/*/*"

    def inbox(self, robot: RobotId) -> str:
        """Return the key to which envelopes for a robot are put."""
        return f"{self._root}/inbox/{robot.hex()}"

    def state(self, robot: RobotId) -> str:
        """Return the key to which a robot publishes its state."""
        return f"{self._root}/state/{robot.hex()}"

    def event(self, robot: RobotId) -> str:
        """Return the key to which a robot publishes its events."""
        return f"{self._root}/event/{robot.hex()}"

    def activity(self, robot: RobotId) -> str:
        """Return the key to which a robot publishes what it does while it has no body."""
        return f"{self._root}/activity/{robot.hex()}"

    def history(self, robot: RobotId) -> str:
        """Return the key under which a robot replies with missed events."""
        return f"{self._root}/history/{robot.hex()}"

    def metadata(self, robot: RobotId) -> str:
        """Return the key under which a robot replies with its metadata."""
        return f"{self._root}/metadata/{robot.hex()}"


class ArenaKeys:
    """The keys of one arena and its bodies."""

    def __init__(self, arena: str) -> None:
        self._root = f"{ROOT}/arena/{arena}"
        self.all_alive = f"{self._root}/alive/*/*"
        self.all_joins = f"{self._root}/body/*/join"
        self.scene = f"{self._root}/scene"
        self.metadata = f"{self._root}/metadata"
        self.activity = f"{self._root}/activity"
        self.all_actions = f"{self._root}/body/*/action"
        self.all_observations = f"{self._root}/body/*/observation"
        self.stop = f"{self._root}/stop"

    def alive(self, arena_run: int, session: str) -> str:
        """Return the key of an arena run's liveliness token."""
        return f"{self._root}/alive/{arena_run}/{session}"

    def stoppable(self, session: str) -> str:
        """Return the key of the liveliness token of a bridge, which answers an emergency stop."""
        return f"{self._root}/stoppable/{session}"

    def join(self, robot: RobotId) -> str:
        """Return the key that a robot queries to get its body, or to leave it."""
        return f"{self._root}/body/{robot.hex()}/join"

    def observation(self, robot: RobotId) -> str:
        """Return the key to which a body's observations are published."""
        return f"{self._root}/body/{robot.hex()}/observation"

    def action(self, robot: RobotId) -> str:
        """Return the key to which a robot publishes its actions."""
        return f"{self._root}/body/{robot.hex()}/action"


def observer(session: str) -> str:
    """Return the key of an observer's liveliness token."""
    return f"{ROOT}/observer/{session}"


def roster_key(colony: str) -> str:
    """Return the key on which the members of a deployment pass on their roster."""
    return f"{ROOT}/roster/{colony}"


def roster_serial_key(colony: str) -> str:
    """Return the key on which they announce which roster they have."""
    return f"{ROOT}/roster/{colony}/serial"


ALL_ROBOTS_ALIVE = f"{ROOT}/colony/*/alive/*/*/*"
ALL_ARENAS_ALIVE = f"{ROOT}/arena/*/alive/*/*"
ALL_SCENES = f"{ROOT}/arena/*/scene"
ALL_STOPS = f"{ROOT}/arena/*/stop"
ALL_STOPPABLE = f"{ROOT}/arena/*/stoppable/*"
ALL_ARENA_ACTIVITIES = f"{ROOT}/arena/*/activity"


_MAX_INCARNATION = 2**32 - 1
_MAX_ARENA_RUN = 2**62 - 1
_MAX_VERSION = 2**32 - 1
_NAME = re.compile(r"[A-Za-z0-9_.-]{1,64}")
"""Name of a colony, an arena or a session."""


class RobotToken(NamedTuple):
    """The parts of the key of a robot's liveliness token."""

    colony: str
    robot: RobotId
    incarnation: int
    session: str


class ArenaToken(NamedTuple):
    """The parts of the key of an arena's liveliness token."""

    arena: str
    arena_run: int
    session: str


def parse_robot_token(key: str) -> RobotToken | None:
    """Return the parts of a robot's token, None if the key is no such token."""
    match chunks(key):
        case ["colony", colony, "alive", name, number, session]:
            robot, incarnation = parse_robot_id(name), _parse_number(number, _MAX_INCARNATION)
            if robot is not None and incarnation is not None and _are_names(colony, session):
                return RobotToken(colony, robot, incarnation, session)
    return None


def parse_arena_token(key: str) -> ArenaToken | None:
    """Return the parts of an arena's token, None if the key is no such token."""
    match chunks(key):
        case ["arena", arena, "alive", number, session]:
            arena_run = _parse_number(number, _MAX_ARENA_RUN)
            if arena_run is not None and _are_names(arena, session):
                return ArenaToken(arena, arena_run, session)
    return None


def parse_stoppable(key: str) -> StopAddress | None:
    """Return the address of the arena or bridge whose token this is, None for other keys."""
    match chunks(key):
        case ["arena", arena, "stoppable", session] if _are_names(arena, session):
            return StopAddress(arena, session)
    return None


def parse_body_topic(key: str, topic: str) -> RobotId | None:
    """Return the robot of a key of its body (action, join), None for other keys."""
    match chunks(key):
        case ["arena", arena, "body", name, found] if found == topic and _are_names(arena):
            return parse_robot_id(name)
    return None


def parse_robot_topic(key: str, topic: str) -> tuple[str, RobotId] | None:
    """Return colony and robot of a key of this topic (state, event, activity …), None for other keys."""
    match chunks(key):
        case ["colony", colony, found, name] if found == topic and _are_names(colony):
            robot = parse_robot_id(name)
            return None if robot is None else (colony, robot)
    return None


def parse_arena_topic(key: str, topic: str) -> str | None:
    """Return the arena of a key of this topic (scene, activity, metadata), None for other keys."""
    match chunks(key):
        case ["arena", arena, found] if found == topic and _are_names(arena):
            return arena
    return None


def parse_incompatible_peer(key: str) -> tuple[RobotId, int] | None:
    """Return robot and version of a token of another version of the protocol, None for other keys."""
    match key.split("/"):
        case ["crcolony", number, "colony", _, "alive", name, _, _]:
            robot, version = parse_robot_id(name), _parse_number(number, _MAX_VERSION)
            if robot is not None and version not in (None, VERSION):
                return robot, version or 0
    return None


def chunks(key: str) -> list[str]:
    """Return the chunks of a key after the protocol's root."""
    return key.removeprefix(f"{ROOT}/").split("/")


def parse_robot_id(chunk: str) -> RobotId | None:
    """Return the robot id in a chunk of a key, None if the chunk is no id."""
    try:
        robot = bytes.fromhex(chunk)
    except ValueError:
        return None
    return robot if len(robot) == ID_BYTES else None


def _are_names(*chunks: str) -> bool:
    return all(_NAME.fullmatch(chunk) for chunk in chunks)


def _parse_number(chunk: str, most: int) -> int | None:
    # The length is checked first: int() of a long text is slow, and refuses some with an error.
    is_number = chunk.isascii() and chunk.isdigit() and len(chunk) <= len(str(most))
    return int(chunk) if is_number and int(chunk) <= most else None
