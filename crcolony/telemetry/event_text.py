"""Formats the events of robots for people: in a robot's own output, and in the log of a dashboard."""

from collections.abc import Callable

from crcolony.evolution.history import Died, TurnedOver
from crcolony.protocol.encounters import Outcome
from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import (
    Activity,
    EncounterOutcome,
    Exchanged,
    Fault,
    RobotEvent,
)

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
            reason = f" ({readable(event.reason)})" if event.reason else ""
            return f"mating with {name_of(event.peer)}: {outcome}{explanation}{reason}"
        case Died(agent=agent):
            return f"agent {readable(agent.rpartition('/')[2])} starved"
        case TurnedOver(generation=generation, offspring=offspring):
            return f"starts generation {generation} from {offspring} offspring"
        case Fault(what=what):
            return readable(what)
    return None


def format_activity(activity: Activity) -> str:
    """Return what a robot or an arena does, with the share of it that is done, if that is known."""
    doing = readable(activity.doing)
    if activity.total == 0:
        return doing
    return f"{doing}, {min(100 * activity.done // activity.total, 100)} %"


def readable(text: str) -> str:
    """Return a text of another process as one line of characters that terminals and viewers can draw.

    Others are escaped: a peer's text moves no cursor, and a character that no font has makes no viewer fail.
    """
    return "".join(c if c.isprintable() and _is_in_fonts(ord(c)) else ascii(c)[1:-1] for c in text)


def _is_in_fonts(code: int) -> bool:
    """Return whether a character is of the Latin or Greek alphabets, or among general punctuation and arrows."""
    return code < 0x250 or 0x370 <= code < 0x400 or 0x2010 <= code < 0x2200


def _partner(robot: RobotId, event: Exchanged) -> RobotId:
    encounter = event.encounter
    return encounter.responder if encounter.initiator == robot else encounter.initiator


def _conception(event: Exchanged) -> str:
    if event.too_late:
        return "too late to conceive"
    return "conceived" if event.conceived else "no offspring"
