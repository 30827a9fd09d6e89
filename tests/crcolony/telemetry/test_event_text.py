"""Events are formatted in one place for all outputs: a robot's own output and the log of a dashboard."""

from typing import get_args

import msgspec
import pytest

from crcolony.evolution.history import Born, Died, Lived, TurnedOver
from crcolony.protocol.encounters import Outcome
from crcolony.protocol.mating_messages import Encounter
from crcolony.protocol.telemetry_messages import (
    Activity,
    EncounterOutcome,
    Exchanged,
    Fault,
    Met,
    RobotEvent,
)
from crcolony.telemetry.event_text import format_activity, format_event, readable
from tests.support.fed_monitor import ME, PEER

ENCOUNTER = Encounter(ME, PEER, 3, 1)
MATED = Exchanged(70, ENCOUNTER, f"{ME.hex()}/0", f"{PEER.hex()}/4", 0.5, True, False)


def text(event: RobotEvent, robot: bytes = ME) -> str | None:
    return format_event(robot, event, {ME: "me", PEER: "peer"}.__getitem__)


@pytest.mark.parametrize(
    ("changes", "robot", "expected"),
    [
        ({}, ME, "mated with peer, conceived (energy 0.50)"),
        ({}, PEER, "mated with me, conceived (energy 0.50)"),
        ({"conceived": False}, ME, "mated with peer, no offspring (energy 0.50)"),
        (
            {"conceived": False, "too_late": True},
            ME,
            "mated with peer, too late to conceive (energy 0.50)",
        ),
    ],
)
def test_a_mating_names_the_partner_and_its_result(
    changes: dict[str, bool], robot: bytes, expected: str
) -> None:
    """Whichever of the two robots has proposed it."""
    assert text(msgspec.structs.replace(MATED, **changes), robot) == expected


@pytest.mark.parametrize("outcome", sorted(set(get_args(Outcome)) - {"mated"}))
def test_an_outcome_is_the_first_word_after_the_partner(outcome: Outcome) -> None:
    """So that programs can read it; the explanation and the reason follow."""
    line = text(EncounterOutcome(9, outcome, PEER, ENCOUNTER, "no room: 256 are open"))
    assert line is not None
    assert line.startswith("mating with peer: ")
    assert line.split(": ", 1)[1].split()[0] == outcome
    assert line.endswith(" (no room: 256 are open)")


def test_an_outcome_without_a_reason_has_no_brackets() -> None:
    """With an explanation where the outcome alone does not explain itself."""
    refused, doubt = (
        text(EncounterOutcome(9, outcome, PEER, None, "")) for outcome in ("refused", "doubt")
    )
    assert refused == "mating with peer: refused"
    assert doubt == "mating with peer: doubt – the partner's decision is unknown"


@pytest.mark.parametrize(
    ("event", "expected"),
    [
        (Died(9, 0, f"{ME.hex()}/17"), "agent 17 starved"),
        (TurnedOver(9, 0, 5, 7), "starts generation 5 from 7 offspring"),
        (Fault(9, "no clock"), "no clock"),
    ],
)
def test_rare_events_have_a_text(event: RobotEvent, expected: str) -> None:
    """Deaths, turnovers and faults."""
    assert text(event) == expected


@pytest.mark.parametrize(
    "event",
    [
        Met(9, PEER, "x/1"),
        Born(9, 0, 1, "x/1", "", b"", None, None),
        Lived(9, 0, 1, "x/1", 50, 0.5, 0, 0),
        EncounterOutcome(9, "mated", PEER, ENCOUNTER, ""),
    ],
)
def test_frequent_events_have_none(event: RobotEvent) -> None:
    """Meetings, births and lifetimes; and the outcome of a mating, which its `Exchanged` reports."""
    assert text(event) is None


def test_a_peers_text_moves_no_cursor_and_needs_no_other_font() -> None:
    """Control characters, emoji and other scripts are escaped, in everything that a peer may write."""
    hostile, escaped = "a\n\x1b[2J😀 ΔΦ → ü", r"a\n\x1b[2J\U0001f600 ΔΦ → ü"
    assert readable(hostile) == escaped
    assert text(Fault(3, hostile)) == escaped
    assert text(Died(3, 0, f"x/{hostile}")) == f"agent {escaped} starved"
    assert escaped in str(text(EncounterOutcome(9, "refused", PEER, None, hostile)))
    assert format_activity(Activity(0, hostile, 1, 2)) == f"{escaped}, 50 %"
    assert readable("/tmp/…: “cannot” be written – α × β") == "/tmp/…: “cannot” be written – α × β"
