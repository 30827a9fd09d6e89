"""What is new in a colony, as a watcher tells it."""

from dataclasses import dataclass

from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import Told


@dataclass(frozen=True)
class Appeared:
    """A robot is on the network."""

    robot: RobotId


@dataclass(frozen=True)
class Vanished:
    """A robot's last token has gone."""

    robot: RobotId


@dataclass(frozen=True)
class Restarted:
    """A robot has begun a newer life than the one that was known."""

    robot: RobotId
    life: int


@dataclass(frozen=True)
class Happened:
    """An event of a robot: each of each life once, a late one when it comes."""

    told: Told


@dataclass(frozen=True)
class ArenaAppeared:
    """An arena is on the network."""

    arena: str


@dataclass(frozen=True)
class ArenaVanished:
    """An arena's last token has gone."""

    arena: str


News = Appeared | Vanished | Restarted | Happened | ArenaAppeared | ArenaVanished
