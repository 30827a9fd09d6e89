"""The status text agrees with what the robots publish."""

import pytest
from crcolony_dashboards.view_model.status_text import format_duration, format_status

from crcolony.protocol.key_expressions import ArenaKeys
from tests.support.fake_telemetry import FakeTelemetry


@pytest.fixture
def telemetry() -> FakeTelemetry:
    return FakeTelemetry()


def words(telemetry: FakeTelemetry) -> str:
    return "\n".join(format_status(telemetry.view))


def test_without_telemetry_it_waits_for_a_colony(telemetry: FakeTelemetry) -> None:
    """As long as nothing was received."""
    assert "Waiting for a colony" in words(telemetry)
    telemetry.join(0)
    assert "Waiting" not in words(telemetry)


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
