"""How everybody lives: each robot its own line, or, of many, how they are distributed."""

import numpy as np
import pytest
from crcolony_dashboards.tabs.life import QUANTILES, LifeTab
from crcolony_dashboards.tabs.tab import MAX_ROBOT_LINES

from tests.support.drawn import TabHarness
from tests.support.fake_telemetry import IDS


@pytest.fixture
def show() -> TabHarness:
    return TabHarness(LifeTab())


class TestEnergy:
    """The energy of the robots."""

    def test_a_few_robots_have_one_line_each(self, show: TabHarness) -> None:
        """With their names, in different colours."""
        show.telemetry.join(*range(MAX_ROBOT_LINES))
        for robot in range(MAX_ROBOT_LINES):
            show.telemetry.state(robot, energy=robot / 20.0)
        streams = show.draw(0.5)
        for robot in range(MAX_ROBOT_LINES):
            path = f"/life/energy/robot_{robot}"
            assert streams.scalars(path) == [[pytest.approx(robot / 20.0)]]
            assert streams.shown(path, "names") == [f"#{robot}"]
        assert "/life/energy/all" not in streams.paths()
        assert streams.colours("/life/energy/robot_0") != streams.colours("/life/energy/robot_1")

    def test_of_more_robots_the_distribution_is_drawn(self, show: TabHarness) -> None:
        """Of all of them, and no single lines."""
        energies = [k / MAX_ROBOT_LINES for k in range(MAX_ROBOT_LINES + 1)]
        for robot, energy in enumerate(energies):
            show.telemetry.join(robot, energy=energy)
        streams = show.draw(0.5)
        (values,) = streams.scalars("/life/energy/all")
        assert values == pytest.approx(np.quantile(energies, QUANTILES))
        assert streams.shown("/life/energy/all", "names") == [
            "10 %",
            "25 %",
            "50 %",
            "75 %",
            "90 %",
        ]
        assert streams.entities("/life/energy/") == ["all"]

    def test_lines_continue_when_many_robots_become_few(self, show: TabHarness) -> None:
        """And the distribution ends."""
        show.telemetry.join(*range(MAX_ROBOT_LINES + 1))
        show.draw(0.5)
        show.telemetry.offline(MAX_ROBOT_LINES)
        streams = show.draw(0.5)
        assert "/life/energy/all" not in streams.paths()
        assert streams.times("/life/energy/robot_0") > 0

    def test_energy_is_drawn_twice_a_second(self, show: TabHarness) -> None:
        """However often the dashboard draws, and not without robots."""
        show.telemetry.join(0)
        points = sum(len(show.draw(0.1).scalars("/life/energy/robot_0")) for _ in range(100))
        assert points == pytest.approx(20, abs=2)
        show.telemetry.offline(0)
        show.draw(0.5)
        for _ in range(10):
            assert show.draw(0.5).paths() == []


class TestModules:
    """The learning modules in control."""

    def test_the_module_in_control_is_named(self, show: TabHarness) -> None:
        """A robot without one has `none`."""
        for robot, module in enumerate((0, 1, -1, 57)):
            show.telemetry.join(robot, module=module)
        streams = show.draw(0.5)
        states = [streams.shown(f"/life/module/robot_{robot}", "state") for robot in range(4)]
        assert states == [["foraging"], ["mating"], ["none"], ["none"]]
        assert streams.shown("/life/module/robot_0", "values") == ["foraging", "mating", "none"]

    def test_modules_of_the_first_robots_are_drawn(self, show: TabHarness) -> None:
        """Up to a limit."""
        show.telemetry.join(*range(MAX_ROBOT_LINES + 5))
        assert len(show.draw(0.5).entities("/life/module/")) == MAX_ROBOT_LINES

    def test_the_share_of_the_mating_module_is_drawn_per_colony(self, show: TabHarness) -> None:
        """Of all its robots, however many."""
        for robot in range(20):
            show.telemetry.join(robot, module=int(robot < 5))
        show.telemetry.join(20, module=1, colony="red")
        streams = show.draw(0.5)
        assert streams.scalars("/life/mating_module/blue") == [[0.25]]
        assert streams.scalars("/life/mating_module/red") == [[1.0]]


class TestRates:
    """How often a robot mates and captures batteries."""

    def test_rates_are_drawn_once_they_are_known(self, show: TabHarness) -> None:
        """Once a second."""
        show.telemetry.join(0, 1, matings=0, captures=0)
        drawn = 0
        for second in range(10):
            show.telemetry.state(0, 1, matings=second, captures=2 * second)
            show.telemetry.advance_s(0.5)
            show.view.update_rates(show.telemetry.at_s)
            drawn += show.draw(0.5).times("/life/rates/matings_blue")
        assert drawn == pytest.approx(9, abs=2)
        assert show.streams.scalars("/life/rates/matings_blue") == [[pytest.approx(60.0)]]
        assert show.streams.scalars("/life/rates/batteries_blue") == [[pytest.approx(120.0)]]
        assert show.streams.shown("/life/rates/matings_blue", "names") == ["matings"]

    def test_with_several_colonies_rates_have_the_colony_in_their_names(
        self, show: TabHarness
    ) -> None:
        """One line for each colony."""
        for _ in range(2):
            show.telemetry.join(0)
            show.telemetry.join(1, colony="red")
            show.view.update_rates(show.telemetry.at_s)
            show.telemetry.advance_s(10.0)
        streams = show.draw(0.5)
        assert streams.shown("/life/rates/matings_red", "names") == ["red: matings"]
        assert streams.shown("/life/rates/batteries_blue", "names") == ["blue: batteries"]


def test_robots_with_equal_numbers_have_lines_named_by_their_ids(show: TabHarness) -> None:
    """No two robots share a line."""
    show.telemetry.join(0, 1, number=3)
    streams = show.draw(0.5)
    assert streams.entities("/life/energy/") == sorted(["all", IDS[0].hex()[:8], IDS[1].hex()[:8]])
