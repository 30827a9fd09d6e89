"""What a process prints for its user."""

import sys

from crcolony.json_log import JsonLines
from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import EncounterOutcome, Exchanged, RobotEvent
from crcolony.telemetry.event_text import format_event


def print_line(line: str) -> None:
    """Print a line at once."""
    print(line, flush=True)


def print_warning(line: str) -> None:
    """Print a line about something that is wrong, though the process goes on; as JSON it has that level."""
    if isinstance(sys.stdout, JsonLines):
        sys.stdout.write_line(line, "warning")
    else:
        print_line(line)


def name_process(**names: str) -> None:
    """Add who this process is, as robot or arena, to all that it prints from now on, where that is JSON."""
    if isinstance(sys.stdout, JsonLines):
        sys.stdout.log.names.update(names)


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
