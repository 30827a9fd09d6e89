"""What a process prints for its user."""

from crcolony.protocol.telemetry_messages import EncounterOutcome, Exchanged, RobotEvent


def print_line(line: str) -> None:
    """Print a line at once."""
    print(line, flush=True)


def print_event(event: RobotEvent) -> None:
    """Print an event, unless it is too frequent."""
    line = format_event(event)
    if line is not None:
        print_line(line)


def format_clock(wall_period_s: float | None) -> str:
    """Return the clock of an arena as text; `wall_period_s` None is lockstep."""
    if wall_period_s is None:
        return "in lockstep"
    return f"{1.0 / wall_period_s:.3g} control periods a second"


def format_event(event: RobotEvent) -> str | None:
    """Return an event as one line of text, or None if it is too frequent to print."""
    match event:
        case Exchanged(partner=partner, conceived=conceived, energy=energy):
            what = "conceived" if conceived else "no offspring"
            return f"mated with {partner[:8]}…, {what} (energy {energy:.2f})"
        case EncounterOutcome(outcome=outcome, peer=peer, reason=reason) if outcome != "mated":
            return f"mating with {peer.hex()[:8]}: {outcome} {reason}".rstrip()
    return None
