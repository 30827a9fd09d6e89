"""What is new in a colony, as a watcher tells it."""

from dataclasses import dataclass

from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import EventMessage


@dataclass(frozen=True)
class RobotJoined:
    """A robot is on the network."""

    robot: RobotId


@dataclass(frozen=True)
class RobotLeft:
    """A robot's last token has gone."""

    robot: RobotId


@dataclass(frozen=True)
class RobotRestarted:
    """A robot has begun a newer life than the one that was known."""

    robot: RobotId
    incarnation: int


@dataclass(frozen=True)
class EventReceived:
    """An event of a robot: each of each life once, a late one when it comes."""

    message: EventMessage


@dataclass(frozen=True)
class ArenaJoined:
    """An arena is on the network."""

    arena: str


@dataclass(frozen=True)
class ArenaLeft:
    """An arena's last token has gone."""

    arena: str


StatusChange = RobotJoined | RobotLeft | RobotRestarted | EventReceived | ArenaJoined | ArenaLeft
