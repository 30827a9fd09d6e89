"""Events have one plain line each; the frequent ones have none."""

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
    ArenaChanged,
    ArenaJoined,
    ArenaLeft,
    EventReceived,
    RobotJoined,
    RobotLeft,
    RobotRestarted,
    StatusChange,
)
from tests.support.fake_telemetry import IDS, agent, born, lived, mated, met


def name_of(robot: bytes) -> str:
    return f"#{IDS.index(robot)}"


def line_of(event: RobotEvent, robot: int = 0) -> LogLine | None:
    return format_change(EventReceived(EventMessage(IDS[robot], 3, 1, 7, event)), name_of)


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (RobotJoined(IDS[1]), LogLine("presence", "#1 is online")),
        (RobotLeft(IDS[1]), LogLine("presence", "#1 is offline", "WARN")),
        (RobotRestarted(IDS[1], 4), LogLine("presence", "#1 restarted: incarnation 4", "WARN")),
        (ArenaJoined("lab"), LogLine("presence", "arena lab is online")),
        (ArenaLeft("lab"), LogLine("presence", "arena lab is offline", "WARN")),
        (
            ArenaChanged("lab", ("arena.packs 8 → 12", "body.jaw false → true")),
            LogLine(
                "presence",
                "arena lab has other settings than before: arena.packs 8 → 12, body.jaw false → true",
                "WARN",
            ),
        ),
    ],
)
def test_joining_and_leaving_have_lines(change: StatusChange, line: LogLine) -> None:
    """Robots by their displayed names, arenas by theirs; leaving is a warning."""
    assert format_change(change, name_of) == line


@pytest.mark.parametrize(
    ("event", "line"),
    [
        (Died(9, 0, agent(0, 17)), LogLine("death", "#0: agent 17 starved", tick=9)),
        (
            TurnedOver(9, 0, 5, 7),
            LogLine("turnover", "#0 starts generation 5 from 7 offspring", tick=9),
        ),
        (Fault(9, "no clock"), LogLine("fault", "#0: no clock", "ERROR", 9)),
    ],
)
def test_events_of_a_robot_have_lines(event: RobotEvent, line: LogLine) -> None:
    """With the tick at which they happened."""
    assert line_of(event) == line


def test_outcomes_of_encounters_have_lines() -> None:
    """With the reason; outcomes that may need attention are warnings."""
    lines = {}
    for outcome in get_args(Outcome):
        encounter = Encounter(IDS[0], IDS[1], 3, 1)
        lines[outcome] = line_of(EncounterOutcome(9, outcome, IDS[1], encounter, "busy"))
    assert lines["mated"] is None
    assert lines["busy"] is None
    with_line = {outcome: line for outcome, line in lines.items() if line is not None}
    assert len({line.text for line in with_line.values()}) == len(with_line) == len(lines) - 2
    for line in with_line.values():
        assert line.text.startswith("#0: mating with #1: ")
        assert line.text.endswith(" (busy)")
    warnings = {outcome for outcome, line in with_line.items() if line.level == "WARN"}
    assert warnings == {"orphaned", "doubt", "storage"}


def test_an_empty_reason_is_left_out() -> None:
    """Without empty brackets."""
    line = line_of(EncounterOutcome(9, "refused", IDS[1], None, ""))
    assert line == LogLine("encounter", "#0: mating with #1: refused", tick=9)


@pytest.mark.parametrize(
    "event", [met(1), born(agent(0, 1)), lived(agent(0, 1)), mated(0, 1, conceived=True)]
)
def test_frequent_events_have_no_line(event: RobotEvent) -> None:
    """Meetings, births and lifetimes; a mating has one by the reports of both robots together."""
    assert line_of(event) is None
