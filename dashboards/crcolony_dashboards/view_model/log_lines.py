"""Status changes of a colony as lines of the log."""

from dataclasses import dataclass
from typing import Literal

from crcolony.evolution.history import Died, TurnedOver
from crcolony.protocol.telemetry_messages import EncounterOutcome, EventMessage, Fault
from crcolony.telemetry.event_text import format_event
from crcolony.telemetry.notices import format_arena_change
from crcolony.telemetry.status_changes import (
    ArenaChanged,
    ArenaJoined,
    ArenaLeft,
    EventReceived,
    RobotJoined,
    RobotLeft,
    RobotRestarted,
    StatusChange,
)
from crcolony_dashboards.view_model.naming import NameLookup

Level = Literal["INFO", "WARN", "ERROR"]
"""As Rerun's text log has them"""

_WARNINGS = ("orphaned", "doubt", "storage")


@dataclass(frozen=True)
class LogLine:
    """A line of the log. The number of lines of one `kind` is limited (`log_buffer.py`)."""

    kind: str
    text: str
    level: Level = "INFO"
    tick: int | None = None
    """Of its event, by the robot; None for what the dashboard itself noticed"""


def format_change(change: StatusChange, name_of: NameLookup) -> LogLine | None:
    """Return the line of a status change; None for the frequent ones, which have none.

    A mating has none here: it is reported by two robots (`mating_reports.py`).
    """
    match change:
        case EventReceived(message=message):
            return _format_event(message, name_of)
        case RobotJoined(robot=robot):
            return LogLine("presence", f"{name_of(robot)} is online")
        case RobotLeft(robot=robot):
            return LogLine("presence", f"{name_of(robot)} is offline", "WARN")
        case RobotRestarted(robot=robot, incarnation=incarnation):
            return LogLine(
                "presence", f"{name_of(robot)} restarted: incarnation {incarnation}", "WARN"
            )
        case ArenaJoined(arena=arena):
            return LogLine("presence", f"arena {arena} is online")
        case ArenaLeft(arena=arena):
            return LogLine("presence", f"arena {arena} is offline", "WARN")
        case ArenaChanged():
            return LogLine("presence", format_arena_change(change), "WARN")
    return None


def _format_event(message: EventMessage, name_of: NameLookup) -> LogLine | None:
    event = message.event
    text = format_event(message.robot, event, name_of)
    if text is None:
        return None
    name = name_of(message.robot)
    match event:
        case Died():
            return LogLine("death", f"{name}: {text}", tick=event.tick)
        case TurnedOver():
            return LogLine("turnover", f"{name} {text}", tick=event.tick)
        case EncounterOutcome(outcome=outcome) if outcome != "busy":
            level: Level = "WARN" if outcome in _WARNINGS else "INFO"
            return LogLine("encounter", f"{name}: {text}", level, event.tick)
        case Fault():
            return LogLine("fault", f"{name}: {text}", "ERROR", event.tick)
    return None
