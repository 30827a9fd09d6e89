"""What a process prints for the person who started it."""

from crcolony.protocol.telemetry_messages import EncounterOutcome, Exchanged, RobotEvent


def print_line(line: str) -> None:
    """Print a line at once."""
    print(line, flush=True)


def _say_event(event: RobotEvent) -> None:
    line = in_words(event)
    if line is not None:
        print_line(line)


def in_words(event: RobotEvent) -> str | None:
    """Return what an event means to a person, or None if it is too common to say."""
    match event:
        case Exchanged(partner=partner, conceived=conceived, energy=energy):
            what = "conceived" if conceived else "no offspring"
            return f"mated with {partner[:8]}…, {what} (energy {energy:.2f})"
        case EncounterOutcome(outcome=outcome, peer=peer, reason=reason) if outcome != "mated":
            return f"mating with {peer.hex()[:8]}: {outcome} {reason}".rstrip()
    return None
