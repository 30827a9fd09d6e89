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
    """Who is hungry."""

    def test_a_few_robots_have_lines_of_their_own(self, show: TabHarness) -> None:
        """By their names, each in its colour."""
        show.sample.join(*range(MAX_ROBOT_LINES))
        for robot in range(MAX_ROBOT_LINES):
            show.sample.state(robot, energy=robot / 20.0)
        streams = show.draw(0.5)
        for robot in range(MAX_ROBOT_LINES):
            path = f"/life/energy/robot_{robot}"
            assert streams.scalars(path) == [[pytest.approx(robot / 20.0)]]
            assert streams.shown(path, "names") == [f"#{robot}"]
        assert "/life/energy/all" not in streams.paths()
        assert streams.colours("/life/energy/robot_0") != streams.colours("/life/energy/robot_1")

    def test_one_more_and_they_become_a_distribution(self, show: TabHarness) -> None:
        """Of all of them; the lines end."""
        energies = [k / MAX_ROBOT_LINES for k in range(MAX_ROBOT_LINES + 1)]
        for robot, energy in enumerate(energies):
            show.sample.join(robot, energy=energy)
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

    def test_lines_go_on_when_many_become_few(self, show: TabHarness) -> None:
        """And the distribution ends."""
        show.sample.join(*range(MAX_ROBOT_LINES + 1))
        show.draw(0.5)
        show.sample.go(MAX_ROBOT_LINES)
        streams = show.draw(0.5)
        assert "/life/energy/all" not in streams.paths()
        assert streams.times("/life/energy/robot_0") > 0

    def test_it_is_drawn_twice_a_second(self, show: TabHarness) -> None:
        """However often the dashboard draws; and not at all when nobody is there."""
        show.sample.join(0)
        points = sum(len(show.draw(0.1).scalars("/life/energy/robot_0")) for _ in range(100))
        assert points == pytest.approx(20, abs=2)
        show.sample.go(0)
        show.draw(0.5)
        for _ in range(10):
            assert show.draw(0.5).paths() == []


class TestModules:
    """Who forages and who looks for a mate."""

    def test_the_module_in_use_is_named(self, show: TabHarness) -> None:
        """A robot without one has none."""
        for robot, module in enumerate((0, 1, -1, 57)):
            show.sample.join(robot, module=module)
        streams = show.draw(0.5)
        states = [streams.shown(f"/life/module/robot_{robot}", "state") for robot in range(4)]
        assert states == [["foraging"], ["mating"], ["none"], ["none"]]
        assert streams.shown("/life/module/robot_0", "values") == ["foraging", "mating", "none"]

    def test_of_many_robots_the_first_are_shown(self, show: TabHarness) -> None:
        """As many as there is room for."""
        show.sample.join(*range(MAX_ROBOT_LINES + 5))
        assert len(show.draw(0.5).entities("/life/module/")) == MAX_ROBOT_LINES

    def test_the_share_of_those_who_look_for_a_mate_is_of_every_colony(
        self, show: TabHarness
    ) -> None:
        """Of all its robots, however many."""
        for robot in range(20):
            show.sample.join(robot, module=int(robot < 5))
        show.sample.join(20, module=1, colony="red")
        streams = show.draw(0.5)
        assert streams.scalars("/life/mating_module/blue") == [[0.25]]
        assert streams.scalars("/life/mating_module/red") == [[1.0]]


class TestRates:
    """How often a robot mates and captures batteries."""

    def test_rates_are_drawn_once_they_are_known(self, show: TabHarness) -> None:
        """Once a second."""
        show.sample.join(0, 1, matings=0, captures=0)
        drawn = 0
        for second in range(10):
            show.sample.state(0, 1, matings=second, captures=2 * second)
            show.sample.pass_s(0.5)
            show.view.update_rates(show.sample.at_s)
            drawn += show.draw(0.5).times("/life/rates/matings_blue")
        assert drawn == pytest.approx(9, abs=2)
        assert show.streams.scalars("/life/rates/matings_blue") == [[pytest.approx(60.0)]]
        assert show.streams.scalars("/life/rates/batteries_blue") == [[pytest.approx(120.0)]]
        assert show.streams.shown("/life/rates/matings_blue", "names") == ["matings"]

    def test_of_several_colonies_the_colony_is_said(self, show: TabHarness) -> None:
        """In the name of its lines."""
        for _ in range(2):
            show.sample.join(0)
            show.sample.join(1, colony="red")
            show.view.update_rates(show.sample.at_s)
            show.sample.pass_s(10.0)
        streams = show.draw(0.5)
        assert streams.shown("/life/rates/matings_red", "names") == ["red: matings"]
        assert streams.shown("/life/rates/batteries_blue", "names") == ["blue: batteries"]


def test_robots_without_a_number_of_their_own_are_called_by_their_ids(show: TabHarness) -> None:
    """So that no two share a line."""
    show.sample.join(0, 1, number=3)
    streams = show.draw(0.5)
    assert streams.entities("/life/energy/") == sorted(["all", IDS[0].hex()[:8], IDS[1].hex()[:8]])
