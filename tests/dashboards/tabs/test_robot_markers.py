"""Everybody is where their arena says, and looks as they say of themselves."""

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
def sample() -> FakeTelemetry:
    return FakeTelemetry()


def looks(sample: FakeTelemetry, of: ColourLookup | None = None) -> RobotColours:
    crowd = robot_markers(sample.view.scenes())
    return (of or ColourLookup()).colours(sample.view, crowd, sample.at_s)


def rgb(colours: palette.Colours) -> Rgb:
    return [tuple(colour) for colour in colours.tolist()]


class TestPlaces:
    """Where everybody is on the picture."""

    @given(st.lists(st.floats(0.1, 100.0), min_size=1, max_size=6))
    def test_arenas_stand_side_by_side(self, widths_m: list[float]) -> None:
        """From left to right, with a gap between; the first, as if it were alone, around 0."""
        sample = FakeTelemetry()
        for number, width_m in enumerate(widths_m):
            sample.scene(arena=f"a{number}", width_m=width_m)
        sample.pass_s(0.0)
        middles_m = arena_offsets_m(sample.view.scenes())
        assert middles_m[0] == 0.0
        lefts_m = np.array(middles_m) - 0.5 * np.array(widths_m)
        rights_m = np.array(middles_m) + 0.5 * np.array(widths_m)
        assert lefts_m[1:] - rights_m[:-1] == pytest.approx(GAP_M)

    def test_robots_are_where_their_arena_is(self, sample: FakeTelemetry) -> None:
        """In the order of arenas, and of robots in them."""
        sample.scene((2, 0.5, -0.5, 1.0), (0, 0.0, 0.25, 2.0), arena="a")
        sample.scene((1, -1.0, 0.5, 3.0), arena="b", width_m=4.0)
        sample.pass_s(0.0)
        crowd = robot_markers(sample.view.scenes())
        assert crowd.robots == [IDS[2], IDS[0], IDS[1]]
        shift_m = 1.0 + GAP_M + 2.0
        assert crowd.points.tolist() == [[0.5, -0.5], [0.0, 0.25], [shift_m - 1.0, 0.5]]
        assert crowd.headings.tolist() == [1.0, 2.0, 3.0]

    def test_robots_are_drawn_larger_in_a_large_arena(self, sample: FakeTelemetry) -> None:
        """So that they can be seen; in a small one as large as they are."""
        sample.scene()
        sample.pass_s(0.0)
        assert robot_markers(sample.view.scenes()).radius_m == 0.11
        sample.scene(height_m=100.0)
        sample.pass_s(0.0)
        assert robot_markers(sample.view.scenes()).radius_m == pytest.approx(0.55)

    def test_nobody_is_a_crowd_too(self) -> None:
        """Without arenas, or in an empty one."""
        crowd = robot_markers([])
        assert (crowd.robots, crowd.points.shape, crowd.headings.shape) == ([], (0, 2), (0,))


class TestLooks:
    """How everybody looks."""

    def test_rings_tell_energy_faces_the_module_and_founders_the_family(
        self, sample: FakeTelemetry
    ) -> None:
        """Each in the order of the crowd, whatever the order in which they were heard."""
        sample.join(0, energy=0.0, module=0, agent=agent(0, 1))
        sample.join(1, energy=1.0, module=1, agent=agent(1, 1))
        sample.tell(0, born(agent(0, 1)))
        sample.tell(1, born(agent(1, 1)))
        sample.scene((1, 0.0, 0.0), (0, 0.5, 0.0))
        sample.pass_s(0.1)
        seen = looks(sample)
        assert rgb(seen.energy) == [palette.GOOD, palette.BAD]
        assert rgb(seen.module) == [palette.MODULES[1], palette.MODULES[0]]
        assert rgb(seen.founder) == [palette.founder_colour(1), palette.founder_colour(0)]
        assert seen.is_stale == [False, False]

    def test_an_agent_without_a_known_birth_has_a_dim_founder(self, sample: FakeTelemetry) -> None:
        """Until its birth is heard of; another agent has a founder of its own."""
        sample.join(0, agent=agent(0, 1))
        sample.scene((0, 0.0, 0.0))
        sample.pass_s(0.1)
        of = ColourLookup()
        assert rgb(looks(sample, of).founder) == [palette.DIM]
        sample.tell(0, born(agent(0, 1)), born(agent(0, 2)))
        for number in (1, 2, 1):
            sample.state(0, agent=agent(0, number))
            sample.pass_s(0.6)
            assert rgb(looks(sample, of).founder) == [palette.founder_colour(number - 1)]

    def test_who_is_silent_gone_or_unknown_is_grey(self, sample: FakeTelemetry) -> None:
        """In all three colours; the others are not."""
        sample.join(0, 1, 2)
        sample.go(1)
        sample.at_s += SILENT_AFTER_S + 0.1
        sample.state(1, 2)
        sample.scene((0, 0.0, 0.0), (1, 0.5, 0.0), (2, 0.0, 0.5), (3, 0.5, 0.5))
        sample.pass_s(0.1)
        seen = looks(sample)
        assert seen.is_stale == [True, True, False, True]
        for colours in (seen.energy, seen.module, seen.founder):
            seen_grey = [colour == palette.STALE for colour in rgb(colours)]
            assert [seen_grey[robot] for robot in (0, 1, 3)] == [True] * 3
        assert rgb(seen.energy)[2] != palette.STALE

    def test_in_a_silent_arena_all_are_grey(self, sample: FakeTelemetry) -> None:
        """Nobody knows where they are; in another one they are not."""
        sample.join(0, 1)
        sample.scene((0, 0.0, 0.0), arena="a")
        sample.at_s += SILENT_AFTER_S + 0.1
        sample.scene((1, 0.0, 0.0), arena="b")
        sample.state(0, 1)
        sample.pass_s(0.1)
        assert looks(sample).is_stale == [True, False]

    def test_colours_are_looked_up_again_after_a_moment(
        self, sample: FakeTelemetry, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """Or at once when somebody else is there."""
        monkeypatch.setattr(markers_module, "_COLOURS_PERIOD_S", 1.0)
        of = ColourLookup()
        sample.join(0, 1, energy=0.0)
        sample.scene((0, 0.0, 0.0))
        sample.pass_s(0.1)
        first = looks(sample, of)
        sample.state(0, 1, energy=1.0)
        sample.pass_s(0.1)
        assert looks(sample, of) is first
        sample.scene((0, 0.0, 0.0), (1, 0.5, 0.0))
        sample.pass_s(0.1)
        assert rgb(looks(sample, of).energy) == [palette.GOOD, palette.GOOD]
        sample.state(0, 1, energy=0.0)
        sample.pass_s(1.0)
        assert rgb(looks(sample, of).energy) == [palette.BAD, palette.BAD]
