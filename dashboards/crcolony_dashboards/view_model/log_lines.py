"""What happens in a colony, in words for the log."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from crcolony.evolution.history import Died, TurnedOver
from crcolony.protocol.identity import RobotId
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

Level = Literal["INFO", "WARN", "ERROR"]
Call = Callable[[RobotId], str]
"""How a robot is called"""

_OUTCOMES = {
    "aborted": "was called off",
    "expired": "came to nothing: no answer in time",
    "refused": "was refused",
    "orphaned": "is orphaned: the partner has not come back",
    "doubt": "is in doubt: the partner has not said how it decided",
    "resolved": "is resolved: the partner is back",
    "storage": "failed: no room on the disk",
}
"""What is said of an encounter; that one has mated or was busy is not"""
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
    me = call(message.robot)
    match message.event:
        case Exchanged(encounter=encounter) as event:
            both = (encounter.initiator, encounter.responder)
            partner = call(both[both[0] == message.robot])
            what = "conceived" if event.conceived else "did not conceive"
            what = "was too late to conceive" if event.too_late else what
            return Line("mating", f"{me} mated with {partner} and {what}")
        case Died(agent=agent):
            return Line("death", f"{me}: agent {number_of(agent)} starved")
        case TurnedOver(generation=generation, offspring=offspring):
            return Line(
                "turnover", f"{me} begins generation {generation} from {offspring} offspring"
            )
        case EncounterOutcome(outcome=outcome, peer=peer, reason=reason) if outcome in _OUTCOMES:
            why = f" ({reason})" if reason else ""
            text = f"{me}: the mating with {call(peer)} {_OUTCOMES[outcome]}{why}"
            return Line("encounter", text, "WARN" if outcome in _WORRYING else "INFO")
        case Fault(what=what):
            return Line("fault", f"{me}: {what}", "ERROR")
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
