"""Robots have the positions of their arenas' scenes, and the colours of their own states."""

import numpy as np
import pytest
from crcolony_dashboards.tabs import palette
from crcolony_dashboards.tabs import robot_markers as markers_module
from crcolony_dashboards.tabs.robot_markers import (
    GAP_M,
    ColourLookup,
    RobotColours,
    arena_offsets_m,
    robot_markers,
)
from hypothesis import given
from hypothesis import strategies as st

from crcolony.protocol.telemetry_messages import SILENT_AFTER_S
from tests.support.fake_telemetry import IDS, FakeTelemetry, agent, born

Rgb = list[tuple[int, ...]]


@pytest.fixture
def telemetry() -> FakeTelemetry:
    return FakeTelemetry()


def colours_of(telemetry: FakeTelemetry, lookup: ColourLookup | None = None) -> RobotColours:
    markers = robot_markers(telemetry.view.scenes())
    return (lookup or ColourLookup()).colours(telemetry.view, markers, telemetry.at_s)


def rgb(colours: palette.Colours) -> Rgb:
    return [tuple(colour) for colour in colours.tolist()]


class TestPositions:
    """Positions on the picture."""

    @given(st.lists(st.floats(0.1, 100.0), min_size=1, max_size=6))
    def test_arenas_are_side_by_side(self, widths_m: list[float]) -> None:
        """From left to right with a gap between; the first is around 0."""
        telemetry = FakeTelemetry()
        for number, width_m in enumerate(widths_m):
            telemetry.scene(arena=f"a{number}", width_m=width_m)
        telemetry.advance_s(0.0)
        middles_m = arena_offsets_m(telemetry.view.scenes())
        assert middles_m[0] == 0.0
        lefts_m = np.array(middles_m) - 0.5 * np.array(widths_m)
        rights_m = np.array(middles_m) + 0.5 * np.array(widths_m)
        assert lefts_m[1:] - rights_m[:-1] == pytest.approx(GAP_M)

    def test_robots_are_where_their_arena_is(self, telemetry: FakeTelemetry) -> None:
        """In the order of the arenas and of the robots in them."""
        telemetry.scene((2, 0.5, -0.5, 1.0), (0, 0.0, 0.25, 2.0), arena="a")
        telemetry.scene((1, -1.0, 0.5, 3.0), arena="b", width_m=4.0)
        telemetry.advance_s(0.0)
        markers = robot_markers(telemetry.view.scenes())
        assert markers.robots == [IDS[2], IDS[0], IDS[1]]
        shift_m = 1.0 + GAP_M + 2.0
        assert markers.points.tolist() == [[0.5, -0.5], [0.0, 0.25], [shift_m - 1.0, 0.5]]
        assert markers.headings.tolist() == [1.0, 2.0, 3.0]

    def test_robots_are_drawn_larger_in_a_large_arena(self, telemetry: FakeTelemetry) -> None:
        """To be visible; in a small arena they have their own size."""
        telemetry.scene()
        telemetry.advance_s(0.0)
        assert robot_markers(telemetry.view.scenes()).radius_m == 0.11
        telemetry.scene(height_m=100.0)
        telemetry.advance_s(0.0)
        assert robot_markers(telemetry.view.scenes()).radius_m == pytest.approx(0.55)

    def test_without_scenes_there_are_no_markers(self) -> None:
        """The arrays are empty."""
        markers = robot_markers([])
        assert (markers.robots, markers.points.shape, markers.headings.shape) == ([], (0, 2), (0,))


class TestColours:
    """Colours by energy, module and founder."""

    def test_colours_are_those_of_energy_module_and_founder(self, telemetry: FakeTelemetry) -> None:
        """In the order of the markers, whatever the order of arrival."""
        telemetry.join(0, energy=0.0, module=0, agent=agent(0, 1))
        telemetry.join(1, energy=1.0, module=1, agent=agent(1, 1))
        telemetry.events(0, born(agent(0, 1)))
        telemetry.events(1, born(agent(1, 1)))
        telemetry.scene((1, 0.0, 0.0), (0, 0.5, 0.0))
        telemetry.advance_s(0.1)
        colours = colours_of(telemetry)
        assert rgb(colours.energy) == [palette.ENERGY[-1], palette.ENERGY[0]]
        assert rgb(colours.module) == [palette.MODULES[1], palette.MODULES[0]]
        assert rgb(colours.founder) == [palette.founder_colour(1), palette.founder_colour(0)]
        assert colours.is_stale == [False, False]

    def test_an_agent_without_a_known_birth_has_a_dim_colour(
        self, telemetry: FakeTelemetry
    ) -> None:
        """Until its birth is received; every agent has the colour of its own founder."""
        telemetry.join(0, agent=agent(0, 1))
        telemetry.scene((0, 0.0, 0.0))
        telemetry.advance_s(0.1)
        lookup = ColourLookup()
        assert rgb(colours_of(telemetry, lookup).founder) == [palette.DIM]
        telemetry.events(0, born(agent(0, 1)), born(agent(0, 2)))
        for number in (1, 2, 1):
            telemetry.state(0, agent=agent(0, number))
            telemetry.advance_s(0.6)
            assert rgb(colours_of(telemetry, lookup).founder) == [
                palette.founder_colour(number - 1)
            ]

    def test_silent_offline_and_unknown_robots_are_grey(self, telemetry: FakeTelemetry) -> None:
        """In all three colours."""
        telemetry.join(0, 1, 2)
        telemetry.offline(1)
        telemetry.at_s += SILENT_AFTER_S + 0.1
        telemetry.state(1, 2)
        telemetry.scene((0, 0.0, 0.0), (1, 0.5, 0.0), (2, 0.0, 0.5), (3, 0.5, 0.5))
        telemetry.advance_s(0.1)
        colours = colours_of(telemetry)
        assert colours.is_stale == [True, True, False, True]
        for kind in (colours.energy, colours.module, colours.founder):
            is_grey = [colour == palette.STALE for colour in rgb(kind)]
            assert [is_grey[robot] for robot in (0, 1, 3)] == [True] * 3
        assert rgb(colours.energy)[2] != palette.STALE

    def test_robots_in_a_silent_arena_are_grey(self, telemetry: FakeTelemetry) -> None:
        """Those in another arena are not."""
        telemetry.join(0, 1)
        telemetry.scene((0, 0.0, 0.0), arena="a")
        telemetry.at_s += SILENT_AFTER_S + 0.1
        telemetry.scene((1, 0.0, 0.0), arena="b")
        telemetry.state(0, 1)
        telemetry.advance_s(0.1)
        assert colours_of(telemetry).is_stale == [True, False]

    def test_colours_are_updated_periodically(
        self, telemetry: FakeTelemetry, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """Or at once if the robots have changed."""
        monkeypatch.setattr(markers_module, "_COLOURS_PERIOD_S", 1.0)
        lookup = ColourLookup()
        telemetry.join(0, 1, energy=0.0)
        telemetry.scene((0, 0.0, 0.0))
        telemetry.advance_s(0.1)
        first = colours_of(telemetry, lookup)
        telemetry.state(0, 1, energy=1.0)
        telemetry.advance_s(0.1)
        assert colours_of(telemetry, lookup) is first
        telemetry.scene((0, 0.0, 0.0), (1, 0.5, 0.0))
        telemetry.advance_s(0.1)
        assert rgb(colours_of(telemetry, lookup).energy) == [palette.ENERGY[-1], palette.ENERGY[-1]]
        telemetry.state(0, 1, energy=0.0)
        telemetry.advance_s(1.0)
        assert rgb(colours_of(telemetry, lookup).energy) == [palette.ENERGY[0], palette.ENERGY[0]]
