"""What happens in a colony, in words for the log."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from crcolony.evolution.history import Died, TurnedOver
from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import EncounterOutcome, EventMessage, Exchanged, Fault
from crcolony.telemetry.event_text import format_event
from crcolony.telemetry.status_changes import (
    ArenaJoined,
    ArenaLeft,
    EventReceived,
    RobotJoined,
    RobotLeft,
    RobotRestarted,
    StatusChange,
)

Level = Literal["INFO", "WARN", "ERROR"]
Call = Callable[[RobotId], str]
"""How a robot is called"""

_WORRYING = ("orphaned", "doubt", "storage")


@dataclass(frozen=True)
class Line:
    """A line of the log. Lines of one `kind` are thinned out when there are too many."""

    kind: str
    text: str
    level: Level = "INFO"


def in_words(changes: StatusChange, call: Call) -> Line | None:
    """Say what has happened, or nothing where it is too ordinary."""
    match changes:
        case EventReceived(message=message):
            return _event_in_words(message, call)
        case RobotJoined(robot=robot):
            return Line("presence", f"{call(robot)} is here")
        case RobotLeft(robot=robot):
            return Line("presence", f"{call(robot)} is gone", "WARN")
        case RobotRestarted(robot=robot, incarnation=incarnation):
            return Line("presence", f"{call(robot)} has begun anew: life {incarnation}", "WARN")
        case ArenaJoined(arena=arena):
            return Line("presence", f"arena {arena} is here")
        case ArenaLeft(arena=arena):
            return Line("presence", f"arena {arena} is gone", "WARN")
    return None


def _event_in_words(message: EventMessage, call: Call) -> Line | None:
    event, text = message.event, format_event(message.robot, message.event, call)
    if text is None:
        return None
    me = call(message.robot)
    match event:
        case Exchanged():
            return Line("mating", f"{me} {text}")
        case Died():
            return Line("death", f"{me}: {text}")
        case TurnedOver():
            return Line("turnover", f"{me} {text}")
        case EncounterOutcome(outcome=outcome) if outcome != "busy":
            level: Level = "WARN" if outcome in _WORRYING else "INFO"
            return Line("encounter", f"{me}: {text}", level)
        case Fault():
            return Line("fault", f"{me}: {text}", "ERROR")
    return None


def number_of(agent: str) -> str:
    """Return an agent's number in its robot."""
    return agent.rpartition("/")[2]


def robot_of(agent: str) -> RobotId:
    """Return the robot that raised an agent; nobody's id if its name does not tell."""
    try:
        return bytes.fromhex(agent.partition("/")[0])
    except ValueError:
        return b""
