"""The log says who did what, in words that a person reads at once, and nothing of what is ordinary."""

from typing import get_args

import pytest
from crcolony_dashboards.view_model.log_lines import (
    LogLine,
    format_change,
)

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


def said(event: RobotEvent, robot: int = 0) -> LogLine | None:
    return format_change(EventReceived(EventMessage(IDS[robot], 3, 1, 7, event)), call)


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        (RobotJoined(IDS[1]), LogLine("presence", "#1 is online")),
        (RobotLeft(IDS[1]), LogLine("presence", "#1 is offline", "WARN")),
        (RobotRestarted(IDS[1], 4), LogLine("presence", "#1 restarted: incarnation 4", "WARN")),
        (ArenaJoined("lab"), LogLine("presence", "arena lab is online")),
        (ArenaLeft("lab"), LogLine("presence", "arena lab is offline", "WARN")),
    ],
)
def test_who_comes_and_goes_is_said(changes: StatusChange, line: LogLine) -> None:
    """Robots by how they are called, arenas by name; who goes is a warning."""
    assert format_change(changes, call) == line


@pytest.mark.parametrize(
    ("event", "line"),
    [
        (mated(0, 1, conceived=True), LogLine("mating", "#0 mated with #1 and conceived")),
        (mated(1, 0), LogLine("mating", "#0 mated with #1 and did not conceive")),
        (
            mated(0, 1, too_late=True),
            LogLine("mating", "#0 mated with #1 and was too late to conceive"),
        ),
        (Died(9, 0, agent(0, 17)), LogLine("death", "#0: agent 17 starved")),
        (TurnedOver(9, 0, 5, 7), LogLine("turnover", "#0 starts generation 5 from 7 offspring")),
        (Fault(9, "no clock"), LogLine("fault", "#0: no clock", "ERROR")),
    ],
)
def test_what_a_robot_does_is_said(event: RobotEvent, line: LogLine) -> None:
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
        assert line.text.startswith("#0: the mating with #1 ")
        assert line.text.endswith(" (busy)")
    worrying = {outcome for outcome, line in message.items() if line.level == "WARN"}
    assert worrying == {"orphaned", "doubt", "storage"}


def test_a_reason_that_nobody_gave_is_not_said() -> None:
    """Nothing stands in brackets then."""
    line = said(EncounterOutcome(9, "refused", IDS[1], None, ""))
    assert line == LogLine("encounter", "#0: the mating with #1 was refused")


@pytest.mark.parametrize("event", [met(1), born(agent(0, 1)), lived(agent(0, 1))])
def test_what_happens_all_the_time_is_not_said(event: RobotEvent) -> None:
    """Meetings, births and lives."""
    assert said(event) is None
