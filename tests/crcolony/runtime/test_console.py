"""What a process prints of its events, and of its clock."""

import pytest

from crcolony.protocol.mating_messages import Encounter
from crcolony.protocol.telemetry_messages import EncounterOutcome, Exchanged, Met
from crcolony.runtime.console import format_clock, print_event

PEER = bytes(range(16))
ENCOUNTER = Encounter(bytes(16), PEER, 1, 2)


def test_matings_and_failed_encounters_are_printed(capsys: pytest.CaptureFixture[str]) -> None:
    """A meeting, and the outcome of a mating that is printed already, are not."""
    print_event(bytes(16), Exchanged(1, ENCOUNTER, "a/1", "0123456789/7", 0.25, True, False))
    print_event(bytes(16), EncounterOutcome(1, "expired", PEER, ENCOUNTER, ""))
    print_event(bytes(16), EncounterOutcome(1, "mated", PEER, ENCOUNTER, ""))
    print_event(bytes(16), Met(1, PEER, "a/1"))
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 2
    assert lines[0].startswith("mated with 00010203, conceived")
    assert lines[1].startswith("mating with 00010203: expired")


def test_a_clock_is_printed_as_periods_a_second() -> None:
    """None is lockstep."""
    assert format_clock(0.05) == "20 control periods a second"
    assert format_clock(None) == "in lockstep"
