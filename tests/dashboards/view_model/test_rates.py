"""How often a robot mates and captures batteries in a minute of its colony's time."""

import pytest
from crcolony_dashboards.view_model.colony_view import ColonyView

from crcolony.telemetry import presence
from crcolony.telemetry.colony_monitor import ColonyMonitor
from tests.support.fake_telemetry import FakeTelemetry


@pytest.fixture
def sample() -> FakeTelemetry:
    return FakeTelemetry()


def rates(sample: FakeTelemetry, colony: str = "blue") -> tuple[float, float] | None:
    return sample.view.colonies[colony].rates.per_robot_minute()


class TestRates:
    """How often a robot mates and captures in a minute of its colony's time."""

    def test_each_mating_counts_once_for_both(self, sample: FakeTelemetry) -> None:
        """Two robots that mate with each other once a minute mate once a minute, each of them."""
        sample.join(0, 1, matings=0, captures=0)
        for minute in range(4):
            sample.state(0, 1, matings=minute, captures=10 * minute)
            sample.view.update_rates(sample.at_s)
            sample.pass_s(20.0)
        assert rates(sample) == pytest.approx((3.0, 30.0))
        assert sample.view.colonies["blue"].rates.matings == 3.0

    def test_what_was_before_is_not_counted(self, sample: FakeTelemetry) -> None:
        """A robot comes with all the matings of its life."""
        sample.join(0, matings=1_000, captures=7_000)
        sample.view.update_rates(sample.at_s)
        sample.pass_s(30.0)
        sample.join(1, matings=500, captures=100)
        sample.view.update_rates(sample.at_s)
        assert rates(sample) == (0.0, 0.0)

    def test_rates_are_of_the_last_minute(self, sample: FakeTelemetry) -> None:
        """What was long ago counts no more."""
        sample.join(0, matings=0, captures=0)
        sample.view.update_rates(sample.at_s)
        sample.state(0, matings=50, captures=50)
        for _ in range(100):
            sample.pass_s(1.0)
            sample.view.update_rates(sample.at_s)
        assert rates(sample) == (0.0, 0.0)
        assert len(sample.view.colonies["blue"].rates.samples) <= 62

    def test_they_are_the_same_as_long_as_nothing_changes(self, sample: FakeTelemetry) -> None:
        """However long that goes on."""
        sample.join(0, matings=0, captures=0)
        for second in range(300):
            sample.state(0, matings=second, captures=7)
            sample.pass_s(1.0)
            sample.view.update_rates(sample.at_s)
            if second in (20, 100, 299):
                assert rates(sample) == pytest.approx((60.0, 0.0), abs=60.0 / second)

    def test_nobody_unmates(self, sample: FakeTelemetry) -> None:
        """A robot whose counts fall has another memory than before: it counts on from there."""
        sample.join(0, matings=0, captures=0)
        for matings, captures in ((10, 10), (2, 3), (3, 3)):
            sample.view.update_rates(sample.at_s)
            sample.state(0, matings=matings, captures=captures)
            sample.pass_s(1.0)
        sample.view.update_rates(sample.at_s)
        colony = sample.view.colonies["blue"].rates
        assert (colony.matings, colony.captures) == (5.5, 10.0)

    def test_minutes_are_those_of_the_arena(self, sample: FakeTelemetry) -> None:
        """A colony that lives ten times as fast mates ten times as often only if it does so by its own clock."""
        sample.join(0, 1, arena="lab", matings=0, captures=0, tick=0)
        for minute in range(4):
            sample.scene((0, 0.0, 0.0), tick=300 * minute)
            sample.state(0, 1, arena="lab", matings=minute, captures=minute, tick=300 * minute)
            sample.pass_s(6.0)
            sample.view.update_rates(sample.at_s)
        assert rates(sample) == pytest.approx((1.0, 1.0))

    def test_another_clock_makes_no_leap(self, sample: FakeTelemetry) -> None:
        """An arena that comes or goes has a time of its own; it is counted anew from there."""
        sample.join(0, matings=0, captures=0)
        sample.scene((0, 0.0, 0.0), tick=10_000_000, arena="b")
        sample.view.update_rates(sample.at_s)
        sample.pass_s(0.5)
        sample.view.update_rates(sample.at_s)
        sample.scene((0, 0.0, 0.0), tick=900_000_000, arena="a")
        sample.pass_s(0.5)
        sample.view.update_rates(sample.at_s)
        assert rates(sample) is None
        sample.scene((0, 0.0, 0.0), tick=900_000_300, arena="a")
        sample.state(0, matings=2, captures=5)
        sample.pass_s(0.5)
        sample.view.update_rates(sample.at_s)
        assert rates(sample) == pytest.approx((2.0, 5.0))

    def test_who_is_forgotten_is_not_remembered_here(
        self, sample: FakeTelemetry, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """Anybody can make up robots without end."""
        monkeypatch.setattr(presence, "MAX_ROBOTS", 3)
        sample = FakeTelemetry(ColonyView(ColonyMonitor()))
        for robot in range(40):
            sample.join(robot)
            sample.view.update_rates(sample.at_s)
            sample.go(robot)
        assert len(sample.view._rate_counter._counted) <= 4
