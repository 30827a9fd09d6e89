"""The status text agrees with what the robots publish."""

import pytest
from crcolony_dashboards.view_model.status_text import (
    format_duration,
    format_events,
    format_status,
)

from crcolony.evolution.history import Died
from crcolony.protocol.key_expressions import ArenaKeys, ColonyKeys
from crcolony.protocol.telemetry_messages import SILENT_AFTER_S, Activity, Fault
from tests.support.fake_telemetry import IDS, FakeTelemetry, agent


@pytest.fixture
def telemetry() -> FakeTelemetry:
    return FakeTelemetry()


def words(telemetry: FakeTelemetry) -> str:
    return "\n".join(format_status(telemetry.view, telemetry.at_s))


def test_without_telemetry_it_waits_for_a_colony(telemetry: FakeTelemetry) -> None:
    """As long as nothing was received."""
    assert "Waiting for a colony" in words(telemetry)
    telemetry.join(0)
    assert "Waiting" not in words(telemetry)


def test_what_starts_has_a_line(telemetry: FakeTelemetry) -> None:
    """An arena and robots, at most five of them; until they are at work."""
    activity = Activity(7, "compiling the step", 4, 10)
    telemetry.handle("activity", ArenaKeys("lab").activity, activity)
    for robot in range(6):
        telemetry.handle("activity", ColonyKeys("blue").activity(IDS[robot]), activity)
    telemetry.advance_s(0.5)
    assert "- arena lab: compiling the step, 40 %" in words(telemetry)
    assert words(telemetry).count(": compiling the step, 40 %") == 5
    assert "- and 2 more" in words(telemetry)
    telemetry.advance_s(5.0)
    assert "compiling" not in words(telemetry)


def test_what_is_awaited_and_what_cannot_be_reached_has_a_line(telemetry: FakeTelemetry) -> None:
    """Endpoints at which nobody answers, and robots of the arena whose tokens do not arrive."""
    telemetry.view.connection_problems = ["nobody answers at tcp/10.0.0.1:7447"]
    telemetry.advance_s(0.5)
    assert "- nobody answers at tcp/10.0.0.1:7447" in words(telemetry)
    telemetry.view.connection_problems = []
    telemetry.handle("online", ArenaKeys("lab").alive(7, "a"))
    telemetry.join(0)
    telemetry.scene((0, 0.0, 0.0), (1, 0.5, 0.0))
    telemetry.advance_s(5.0)
    assert "**1 of 2 robots in arena lab cannot be reached from here: " in words(telemetry)


def test_robots_online_and_offline_are_counted(telemetry: FakeTelemetry) -> None:
    """A robot that has just joined is not offline before the next update."""
    telemetry.join(0)
    assert words(telemetry).startswith("### 1 robot online\n")
    telemetry.online(1, 2)
    assert words(telemetry).startswith("### 1 robot online\n")
    telemetry.advance_s(0.5)
    telemetry.offline(2)
    telemetry.advance_s(0.5)
    assert words(telemetry).startswith("### 2 robots online, 1 offline\n")


def test_an_arena_has_its_time_and_its_number_of_bodies(telemetry: FakeTelemetry) -> None:
    """Until it is offline; one without a plausible scene is left out."""
    telemetry.handle("online", ArenaKeys("lab").alive(7, "a"))
    telemetry.handle("online", ArenaKeys("implausible").alive(7, "a"))
    telemetry.scene((0, 0.0, 0.0), (1, 0.5, 0.0), tick=18_305)
    telemetry.scene((0, 0.0, 0.0), arena="implausible", period_s=float("nan"))
    telemetry.advance_s(0.5)
    assert "- arena **lab**: time 1:01:01, 2 bodies" in words(telemetry)
    assert "implausible" not in words(telemetry)
    telemetry.handle("offline", ArenaKeys("lab").alive(7, "a"))
    assert "- arena **lab** is offline" in words(telemetry)


def test_the_text_says_that_positions_are_missing(telemetry: FakeTelemetry) -> None:
    """Just when the robots of that arena are drawn grey."""
    telemetry.handle("online", ArenaKeys("lab").alive(7, "a"))
    telemetry.scene((0, 0.0, 0.0))
    telemetry.advance_s(SILENT_AFTER_S)
    assert "no positions" not in words(telemetry)
    telemetry.advance_s(1.0)
    assert "- **no positions for 3 s**: robots are grey where they were last seen" in words(
        telemetry
    )


def test_the_last_five_events_are_listed_newest_first(telemetry: FakeTelemetry) -> None:
    """With the colony's time if it is known, and as they are: no text of a peer is markup."""
    view = telemetry.view
    assert format_events(view.events, None) == "Nothing has happened yet."
    telemetry.join(0)
    for number in range(6):
        telemetry.events(0, Died(50 + number, 0, agent(0, number)))
    telemetry.events(0, Fault(9_000, "*[x](http://y)*"))
    lines = format_events(view.events, 0.2).splitlines()
    assert lines[0] == r"- 0:30:00  \#0: \*\[x\]\(http://y\)\*"
    assert lines[1:] == [
        rf"- {time}  \#0: agent {number} starved"
        for time, number in (("0:00:11", 5), ("0:00:10", 4), ("0:00:10", 3), ("0:00:10", 2))
    ]
    assert format_events(view.events, None).splitlines()[1] == r"- \#0: agent 5 starved"


def test_the_counts_of_a_colony_are_summed(telemetry: FakeTelemetry) -> None:
    """Each mating once, though two robots count it; generations from the lowest to the highest."""
    telemetry.join(0, generation=4, energy=0.5, matings=3000, conceptions=1200, captures=5)
    telemetry.join(1, generation=6, energy=0.3, matings=1000, conceptions=34, captures=6)
    telemetry.join(2, colony="red", generation=1, doubts=0, orphaned=0)
    blue = words(telemetry).partition("**red**")[0]
    assert "**blue**: generation 4 to 6" in blue
    assert "- mean energy 0.40" in blue
    assert "- 2,000 matings, 1,234 offspring conceived" in blue
    assert "- 11 batteries captured" in blue
    assert "**red**: generation 1\n" in words(telemetry)


def test_matings_in_doubt_have_a_line(telemetry: FakeTelemetry) -> None:
    """Only if there are any."""
    telemetry.join(0, doubts=0, orphaned=0)
    telemetry.join(1, colony="green", doubts=3, orphaned=0)
    telemetry.join(2, colony="red", doubts=0, orphaned=1)
    blue, _, others = words(telemetry).partition("**green**")
    green, _, red = others.partition("**red**")
    assert "doubt" not in blue
    assert "- 3 matings in doubt, 0 orphaned" in green
    assert "- 0 matings in doubt, 1 orphaned" in red


def test_rates_have_a_line_once_they_are_known(telemetry: FakeTelemetry) -> None:
    """Per robot and minute."""
    telemetry.join(0, 1, matings=0, captures=0)
    telemetry.view.update_rates(telemetry.at_s)
    assert "minute" not in words(telemetry)
    telemetry.advance_s(30.0)
    telemetry.state(0, 1, matings=2, captures=3)
    telemetry.advance_s(0.5)
    telemetry.view.update_rates(telemetry.at_s)
    assert "- per robot and minute 3.93 matings, 5.90 batteries" in words(telemetry)


@pytest.mark.parametrize(
    ("seconds", "text"), [(0.0, "0:00:00"), (59.9, "0:00:59"), (3661.0, "1:01:01"), (4e5, "111:06:40")]
)  # fmt: skip
def test_a_duration_is_hours_minutes_and_seconds(seconds: float, text: str) -> None:
    """Days are hours too."""
    assert format_duration(seconds) == text
