"""Formats the events of robots for people: in a robot's own output, and in the log of a dashboard."""

from collections.abc import Callable

from crcolony.evolution.history import Died, TurnedOver
from crcolony.protocol.encounters import Outcome
from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import EncounterOutcome, Exchanged, Fault, RobotEvent

_EXPLANATIONS: dict[Outcome, str] = {
    "expired": "no reply in time",
    "orphaned": "the partner did not return",
    "doubt": "the partner's decision is unknown",
    "resolved": "the partner is back",
    "storage": "the disk is full",
}
"""Of outcomes that do not explain themselves."""


def format_event(
    robot: RobotId, event: RobotEvent, name_of: Callable[[RobotId], str]
) -> str | None:
    """Return what an event of a robot means, without the robot's name; None if it is not worth a line.

    `name_of` returns how another robot is called. An encounter that ended in a mating is reported by its `Exchanged`.
    """
    match event:
        case Exchanged():
            partner = name_of(_partner(robot, event))
            return f"mated with {partner}, {_conception(event)} (energy {event.energy:.2f})"
        case EncounterOutcome(outcome=outcome) if outcome != "mated":
            explanation = f" – {_EXPLANATIONS[outcome]}" if outcome in _EXPLANATIONS else ""
            reason = f" ({event.reason})" if event.reason else ""
            return f"mating with {name_of(event.peer)}: {outcome}{explanation}{reason}"
        case Died(agent=agent):
            return f"agent {agent.rpartition('/')[2]} starved"
        case TurnedOver(generation=generation, offspring=offspring):
            return f"starts generation {generation} from {offspring} offspring"
        case Fault(what=what):
            return what
    return None


def _partner(robot: RobotId, event: Exchanged) -> RobotId:
    encounter = event.encounter
    return encounter.responder if encounter.initiator == robot else encounter.initiator


def _conception(event: Exchanged) -> str:
    if event.too_late:
        return "too late to conceive"
    return "conceived" if event.conceived else "no offspring"
