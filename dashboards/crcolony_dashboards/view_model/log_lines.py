"""Status changes of a colony as lines of the log."""

from dataclasses import dataclass
from typing import Literal

from crcolony.evolution.history import Died, TurnedOver
from crcolony.protocol.telemetry_messages import EncounterOutcome, EventMessage, Exchanged, Fault
from crcolony.telemetry.status_changes import (
    ArenaJoined,
    ArenaLeft,
    EventReceived,
    RobotJoined,
    RobotLeft,
    RobotRestarted,
    StatusChange,
)
from crcolony_dashboards.view_model.naming import NameLookup, agent_number

Level = Literal["INFO", "WARN", "ERROR"]
"""As Rerun's text log has them"""

_OUTCOMES = {
    "aborted": "was aborted",
    "expired": "expired: no reply in time",
    "refused": "was refused",
    "orphaned": "is orphaned: the partner did not return",
    "doubt": "is in doubt: the partner's decision is unknown",
    "resolved": "is resolved: the partner is back",
    "storage": "failed: the disk is full",
}
"""Outcomes that have a line; `mated` has its own event, and `busy` is too frequent"""
_WARNINGS = ("orphaned", "doubt", "storage")


@dataclass(frozen=True)
class LogLine:
    """A line of the log. The number of lines of one `kind` is limited (`log_buffer.py`)."""

    kind: str
    text: str
    level: Level = "INFO"


def format_change(change: StatusChange, name_of: NameLookup) -> LogLine | None:
    """Return the line of a status change; None for the frequent ones, which have none."""
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
    return None


def _format_event(message: EventMessage, name_of: NameLookup) -> LogLine | None:
    name = name_of(message.robot)
    match message.event:
        case Exchanged(encounter=encounter) as event:
            both = (encounter.initiator, encounter.responder)
            partner = name_of(both[both[0] == message.robot])
            what = "conceived" if event.conceived else "did not conceive"
            what = "was too late to conceive" if event.too_late else what
            return LogLine("mating", f"{name} mated with {partner} and {what}")
        case Died(agent=agent):
            return LogLine("death", f"{name}: agent {agent_number(agent)} starved")
        case TurnedOver(generation=generation, offspring=offspring):
            return LogLine(
                "turnover", f"{name} starts generation {generation} from {offspring} offspring"
            )
        case EncounterOutcome(outcome=outcome, peer=peer, reason=reason) if outcome in _OUTCOMES:
            why = f" ({reason})" if reason else ""
            text = f"{name}: the mating with {name_of(peer)} {_OUTCOMES[outcome]}{why}"
            return LogLine("encounter", text, "WARN" if outcome in _WARNINGS else "INFO")
        case Fault(what=what):
            return LogLine("fault", f"{name}: {what}", "ERROR")
    return None
