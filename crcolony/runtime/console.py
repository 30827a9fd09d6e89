"""What a process prints for its user."""

from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import EncounterOutcome, Exchanged, RobotEvent
from crcolony.telemetry.event_text import format_event


def print_line(line: str) -> None:
    """Print a line at once."""
    print(line, flush=True)


def print_event(robot: RobotId, event: RobotEvent) -> None:
    """Print an event of a robot here if it is about a mating; other events are too frequent or printed elsewhere."""
    if isinstance(event, Exchanged | EncounterOutcome):
        text = format_event(robot, event, lambda peer: peer.hex()[:8])
        if text is not None:
            print_line(text)


def format_clock(wall_period_s: float | None) -> str:
    """Return the clock of an arena as text; `wall_period_s` None is lockstep."""
    if wall_period_s is None:
        return "in lockstep"
    return f"{1.0 / wall_period_s:.3g} control periods a second"
