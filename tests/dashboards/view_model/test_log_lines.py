"""The log says who did what, in words that a person reads at once, and nothing of what is ordinary."""

from typing import get_args

import pytest
from crcolony_dashboards.view_model.log_lines import Line, in_words, number_of, robot_of

from crcolony.evolution.history import Died, TurnedOver
from crcolony.protocol.encounters import Outcome
from crcolony.protocol.mating_messages import Encounter
from crcolony.protocol.telemetry_messages import EncounterOutcome, EventMessage, Fault, RobotEvent
from crcolony.telemetry.status_changes import (
    ArenaJoined,
    ArenaLeft,
    EventReceived,
    RobotJoined,
    RobotLeft,
    RobotRestarted,
    StatusChange,
)
from tests.support.fake_telemetry import IDS, agent, born, lived, mated, met


def call(robot: bytes) -> str:
    return f"#{IDS.index(robot)}"


def said(event: RobotEvent, robot: int = 0) -> Line | None:
    return in_words(EventReceived(EventMessage(IDS[robot], 3, 1, 7, event)), call)


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        (RobotJoined(IDS[1]), Line("presence", "#1 is here")),
        (RobotLeft(IDS[1]), Line("presence", "#1 is gone", "WARN")),
        (RobotRestarted(IDS[1], 4), Line("presence", "#1 has begun anew: life 4", "WARN")),
        (ArenaJoined("lab"), Line("presence", "arena lab is here")),
        (ArenaLeft("lab"), Line("presence", "arena lab is gone", "WARN")),
    ],
)
def test_who_comes_and_goes_is_said(changes: StatusChange, line: Line) -> None:
    """Robots by how they are called, arenas by name; who goes is a warning."""
    assert in_words(changes, call) == line


@pytest.mark.parametrize(
    ("event", "line"),
    [
        (mated(0, 1, conceived=True), Line("mating", "#0 mated with #1, conceived (energy 0.50)")),
        (mated(1, 0), Line("mating", "#0 mated with #1, no offspring (energy 0.50)")),
        (
            mated(0, 1, too_late=True),
            Line("mating", "#0 mated with #1, too late to conceive (energy 0.50)"),
        ),
        (Died(9, 0, agent(0, 17)), Line("death", "#0: agent 17 starved")),
        (TurnedOver(9, 0, 5, 7), Line("turnover", "#0 begins generation 5 from 7 offspring")),
        (Fault(9, "no clock"), Line("fault", "#0: no clock", "ERROR")),
    ],
)
def test_what_a_robot_does_is_said(event: RobotEvent, line: Line) -> None:
    """A mating with the partner, whoever of the two proposed it."""
    assert said(event) == line


def test_what_became_of_a_mating_is_said_unless_it_took_place() -> None:
    """With the reason; what may worry a person is a warning."""
    lines = {}
    for outcome in get_args(Outcome):
        encounter = Encounter(IDS[0], IDS[1], 3, 1)
        lines[outcome] = said(EncounterOutcome(9, outcome, IDS[1], encounter, "busy"))
    assert lines["mated"] is None
    assert lines["busy"] is None
    message = {outcome: line for outcome, line in lines.items() if line is not None}
    assert len({line.text for line in message.values()}) == len(message) == len(lines) - 2
    for line in message.values():
        assert line.text.startswith("#0: mating with #1: ")
        assert line.text.endswith(" (busy)")
    worrying = {outcome for outcome, line in message.items() if line.level == "WARN"}
    assert worrying == {"orphaned", "doubt", "storage"}


def test_a_reason_that_nobody_gave_is_not_said() -> None:
    """Nothing stands in brackets then."""
    line = said(EncounterOutcome(9, "refused", IDS[1], None, ""))
    assert line == Line("encounter", "#0: mating with #1: refused")


@pytest.mark.parametrize("event", [met(1), born(agent(0, 1)), lived(agent(0, 1))])
def test_what_happens_all_the_time_is_not_said(event: RobotEvent) -> None:
    """Meetings, births and lives."""
    assert said(event) is None


def test_an_agents_name_tells_its_number_and_its_robot() -> None:
    """A name that tells no robot is nobody's."""
    assert number_of(agent(3, 17)) == "17"
    assert robot_of(agent(3, 17)) == IDS[3]
    assert (number_of("x"), robot_of("x")) == ("x", b"")
