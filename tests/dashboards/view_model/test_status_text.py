"""How a colony is, in a few words that agree with what its robots say."""

import pytest
from crcolony_dashboards.view_model.status_text import format_duration, format_status

from crcolony.protocol.key_expressions import ArenaKeys
from tests.support.fake_telemetry import FakeTelemetry


@pytest.fixture
def sample() -> FakeTelemetry:
    return FakeTelemetry()


def words(sample: FakeTelemetry) -> str:
    return "\n".join(format_status(sample.view))


def test_nobody_is_looked_for(sample: FakeTelemetry) -> None:
    """As long as nothing at all was heard."""
    assert "Waiting for a colony" in words(sample)
    sample.join(0)
    assert "Waiting" not in words(sample)


def test_who_is_alive_and_who_is_gone_is_counted(sample: FakeTelemetry) -> None:
    """A robot that has just come is not gone, even before anybody has looked."""
    sample.join(0)
    assert words(sample).startswith("### 1 robot online\n")
    sample.come(1, 2)
    assert words(sample).startswith("### 1 robot online\n")
    sample.pass_s(0.5)
    sample.go(2)
    sample.pass_s(0.5)
    assert words(sample).startswith("### 2 robots online, 1 offline\n")


def test_an_arena_tells_its_time_and_how_many_bodies_it_has(sample: FakeTelemetry) -> None:
    """Until it is gone; one of which nothing was seen that could be shown says nothing."""
    sample.on_event("alive", ArenaKeys("lab").alive(7, "a"))
    sample.on_event("alive", ArenaKeys("liar").alive(7, "a"))
    sample.scene((0, 0.0, 0.0), (1, 0.5, 0.0), tick=18_305)
    sample.scene((0, 0.0, 0.0), arena="liar", period_s=float("nan"))
    sample.pass_s(0.5)
    assert "- arena **lab**: time 1:01:01, 2 bodies" in words(sample)
    assert "liar" not in words(sample)
    sample.on_event("gone", ArenaKeys("lab").alive(7, "a"))
    assert "- arena **lab** is offline" in words(sample)


def test_a_colony_is_summed_up(sample: FakeTelemetry) -> None:
    """Each mating once, though two robots count it; generations from the first to the last."""
    sample.join(0, generation=4, energy=0.5, matings=3000, conceptions=1200, captures=5)
    sample.join(1, generation=6, energy=0.3, matings=1000, conceptions=34, captures=6)
    sample.join(2, colony="red", generation=1, doubts=0, orphaned=0)
    blue = words(sample).partition("**red**")[0]
    assert "**blue**: generation 4 to 6" in blue
    assert "- mean energy 0.40" in blue
    assert "- 2,000 matings, 1,234 offspring conceived" in blue
    assert "- 11 batteries captured" in blue
    assert "**red**: generation 1\n" in words(sample)


def test_matings_in_doubt_are_said_where_there_are_any(sample: FakeTelemetry) -> None:
    """And nothing of them where there are none."""
    sample.join(0, doubts=0, orphaned=0)
    sample.join(1, colony="green", doubts=3, orphaned=0)
    sample.join(2, colony="red", doubts=0, orphaned=1)
    blue, _, others = words(sample).partition("**green**")
    green, _, red = others.partition("**red**")
    assert "doubt" not in blue
    assert "- 3 matings in doubt, 0 orphaned" in green
    assert "- 0 matings in doubt, 1 orphaned" in red


def test_rates_are_said_once_they_are_known(sample: FakeTelemetry) -> None:
    """Of a robot in a minute."""
    sample.join(0, 1, matings=0, captures=0)
    sample.view.update_rates(sample.at_s)
    assert "minute" not in words(sample)
    sample.pass_s(30.0)
    sample.state(0, 1, matings=2, captures=3)
    sample.pass_s(0.5)
    sample.view.update_rates(sample.at_s)
    assert "- per robot and minute 3.93 matings, 5.90 batteries" in words(sample)


@pytest.mark.parametrize(
    ("seconds", "text"), [(0.0, "0:00:00"), (59.9, "0:00:59"), (3661.0, "1:01:01"), (4e5, "111:06:40")]
)  # fmt: skip
def test_a_time_is_hours_minutes_and_seconds(seconds: float, text: str) -> None:
    """Days are hours too."""
    assert format_duration(seconds) == text
