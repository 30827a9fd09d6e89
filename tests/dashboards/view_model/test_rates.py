"""How often a robot mates and captures batteries in a minute of its colony's time."""

import pytest
from crcolony_dashboards.view_model.colony_view import ColonyView

from crcolony.telemetry import presence
from crcolony.telemetry.colony_monitor import ColonyMonitor
from tests.support.fake_telemetry import FakeTelemetry


@pytest.fixture
def telemetry() -> FakeTelemetry:
    return FakeTelemetry()


def rates(telemetry: FakeTelemetry, colony: str = "blue") -> tuple[float, float] | None:
    return telemetry.view.colonies[colony].rates.per_robot_minute()


class TestRates:
    """Matings and captures per robot and minute."""

    def test_each_mating_counts_once_for_both(self, telemetry: FakeTelemetry) -> None:
        """Two robots that mate with each other once a minute mate once a minute, each of them."""
        telemetry.join(0, 1, matings=0, captures=0)
        for minute in range(4):
            telemetry.state(0, 1, matings=minute, captures=10 * minute)
            telemetry.view.update_rates(telemetry.at_s)
            telemetry.advance_s(20.0)
        assert rates(telemetry) == pytest.approx((3.0, 30.0))
        assert telemetry.view.colonies["blue"].rates.matings == 3.0

    def test_earlier_events_are_not_counted(self, telemetry: FakeTelemetry) -> None:
        """A robot joins with all the matings of its past."""
        telemetry.join(0, matings=1_000, captures=7_000)
        telemetry.view.update_rates(telemetry.at_s)
        telemetry.advance_s(30.0)
        telemetry.join(1, matings=500, captures=100)
        telemetry.view.update_rates(telemetry.at_s)
        assert rates(telemetry) == (0.0, 0.0)

    def test_rates_are_of_the_last_minute(self, telemetry: FakeTelemetry) -> None:
        """Earlier events no longer count."""
        telemetry.join(0, matings=0, captures=0)
        telemetry.view.update_rates(telemetry.at_s)
        telemetry.state(0, matings=50, captures=50)
        for _ in range(100):
            telemetry.advance_s(1.0)
            telemetry.view.update_rates(telemetry.at_s)
        assert rates(telemetry) == (0.0, 0.0)
        assert len(telemetry.view.colonies["blue"].rates.samples) <= 62

    def test_steady_events_have_a_steady_rate(self, telemetry: FakeTelemetry) -> None:
        """However long they continue."""
        telemetry.join(0, matings=0, captures=0)
        for second in range(300):
            telemetry.state(0, matings=second, captures=7)
            telemetry.advance_s(1.0)
            telemetry.view.update_rates(telemetry.at_s)
            if second in (20, 100, 299):
                assert rates(telemetry) == pytest.approx((60.0, 0.0), abs=60.0 / second)

    def test_counts_that_fall_are_ignored(self, telemetry: FakeTelemetry) -> None:
        """The robot has lost its memory; counting continues from the new counts."""
        telemetry.join(0, matings=0, captures=0)
        for matings, captures in ((10, 10), (2, 3), (3, 3)):
            telemetry.view.update_rates(telemetry.at_s)
            telemetry.state(0, matings=matings, captures=captures)
            telemetry.advance_s(1.0)
        telemetry.view.update_rates(telemetry.at_s)
        colony = telemetry.view.colonies["blue"].rates
        assert (colony.matings, colony.captures) == (5.5, 10.0)

    def test_minutes_are_those_of_the_arena(self, telemetry: FakeTelemetry) -> None:
        """A colony that runs ten times as fast has the rates of its own clock."""
        telemetry.join(0, 1, arena="lab", matings=0, captures=0, tick=0)
        for minute in range(4):
            telemetry.scene((0, 0.0, 0.0), tick=300 * minute)
            telemetry.state(0, 1, arena="lab", matings=minute, captures=minute, tick=300 * minute)
            telemetry.advance_s(6.0)
            telemetry.view.update_rates(telemetry.at_s)
        assert rates(telemetry) == pytest.approx((1.0, 1.0))

    def test_another_clock_starts_the_window_again(self, telemetry: FakeTelemetry) -> None:
        """The times of two arenas are unrelated."""
        telemetry.join(0, matings=0, captures=0)
        telemetry.scene((0, 0.0, 0.0), tick=10_000_000, arena="b")
        telemetry.view.update_rates(telemetry.at_s)
        telemetry.advance_s(0.5)
        telemetry.view.update_rates(telemetry.at_s)
        telemetry.scene((0, 0.0, 0.0), tick=900_000_000, arena="a")
        telemetry.advance_s(0.5)
        telemetry.view.update_rates(telemetry.at_s)
        assert rates(telemetry) is None
        telemetry.scene((0, 0.0, 0.0), tick=900_000_300, arena="a")
        telemetry.state(0, matings=2, captures=5)
        telemetry.advance_s(0.5)
        telemetry.view.update_rates(telemetry.at_s)
        assert rates(telemetry) == pytest.approx((2.0, 5.0))

    def test_dropped_robots_are_dropped_here_too(
        self, telemetry: FakeTelemetry, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """Any peer can invent robots."""
        monkeypatch.setattr(presence, "MAX_ROBOTS", 3)
        telemetry = FakeTelemetry(ColonyView(ColonyMonitor()))
        for robot in range(40):
            telemetry.join(robot)
            telemetry.view.update_rates(telemetry.at_s)
            telemetry.offline(robot)
        assert len(telemetry.view._rate_counter._counted) <= 4
