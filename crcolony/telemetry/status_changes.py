"""What a `ColonyMonitor` reports: changes in the status of robots and arenas."""

from dataclasses import dataclass

from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import EventMessage


@dataclass(frozen=True)
class RobotJoined:
    """A robot came online."""

    robot: RobotId


@dataclass(frozen=True)
class RobotLeft:
    """A robot went offline: its last token is gone."""

    robot: RobotId


@dataclass(frozen=True)
class RobotRestarted:
    """A robot has a newer incarnation than the one that was known."""

    robot: RobotId
    incarnation: int


@dataclass(frozen=True)
class EventReceived:
    """An event of a robot arrived. Every event is reported once, late ones when they arrive."""

    message: EventMessage


@dataclass(frozen=True)
class ArenaJoined:
    """An arena came online."""

    arena: str


@dataclass(frozen=True)
class ArenaLeft:
    """An arena went offline: its last token is gone."""

    arena: str


@dataclass(frozen=True)
class ArenaChanged:
    """A new run of an arena has other settings than the run before."""

    arena: str
    changes: tuple[str, ...]
    """`group.name old → new`"""


StatusChange = (
    RobotJoined
    | RobotLeft
    | RobotRestarted
    | EventReceived
    | ArenaJoined
    | ArenaLeft
    | ArenaChanged
)
