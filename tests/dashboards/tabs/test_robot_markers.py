"""Everybody is where their arena says, and looks as they say of themselves."""

import numpy as np
import pytest
from crcolony_dashboards.tabs import palette
from crcolony_dashboards.tabs import robot_markers as crowd_module
from crcolony_dashboards.tabs.robot_markers import GAP_M, Looks, LooksOf, crowd_of, offsets_m
from hypothesis import given
from hypothesis import strategies as st

from crcolony.protocol.telemetry_messages import SILENT_AFTER_S
from tests.support.fake_telemetry import IDS, FakeTelemetry, agent, born

Rgb = list[tuple[int, ...]]


@pytest.fixture
def heard() -> FakeTelemetry:
    return FakeTelemetry()


def looks(heard: FakeTelemetry, of: LooksOf | None = None) -> Looks:
    crowd = crowd_of(heard.spectator.scenes())
    return (of or LooksOf()).of(heard.spectator, crowd, heard.at_s)


def rgb(colours: palette.Colours) -> Rgb:
    return [tuple(colour) for colour in colours.tolist()]


class TestPlaces:
    """Where everybody is on the picture."""

    @given(st.lists(st.floats(0.1, 100.0), min_size=1, max_size=6))
    def test_arenas_stand_side_by_side(self, widths_m: list[float]) -> None:
        """From left to right, with a gap between; the first, as if it were alone, around 0."""
        heard = FakeTelemetry()
        for number, width_m in enumerate(widths_m):
            heard.scene(arena=f"a{number}", width_m=width_m)
        heard.pass_s(0.0)
        middles_m = offsets_m(heard.spectator.scenes())
        assert middles_m[0] == 0.0
        lefts_m = np.array(middles_m) - 0.5 * np.array(widths_m)
        rights_m = np.array(middles_m) + 0.5 * np.array(widths_m)
        assert lefts_m[1:] - rights_m[:-1] == pytest.approx(GAP_M)

    def test_robots_are_where_their_arena_is(self, heard: FakeTelemetry) -> None:
        """In the order of arenas, and of robots in them."""
        heard.scene((2, 0.5, -0.5, 1.0), (0, 0.0, 0.25, 2.0), arena="a")
        heard.scene((1, -1.0, 0.5, 3.0), arena="b", width_m=4.0)
        heard.pass_s(0.0)
        crowd = crowd_of(heard.spectator.scenes())
        assert crowd.robots == [IDS[2], IDS[0], IDS[1]]
        shift_m = 1.0 + GAP_M + 2.0
        assert crowd.points.tolist() == [[0.5, -0.5], [0.0, 0.25], [shift_m - 1.0, 0.5]]
        assert crowd.headings.tolist() == [1.0, 2.0, 3.0]

    def test_robots_are_drawn_larger_in_a_large_arena(self, heard: FakeTelemetry) -> None:
        """So that they can be seen; in a small one as large as they are."""
        heard.scene()
        heard.pass_s(0.0)
        assert crowd_of(heard.spectator.scenes()).radius_m == 0.11
        heard.scene(height_m=100.0)
        heard.pass_s(0.0)
        assert crowd_of(heard.spectator.scenes()).radius_m == pytest.approx(0.55)

    def test_nobody_is_a_crowd_too(self) -> None:
        """Without arenas, or in an empty one."""
        crowd = crowd_of([])
        assert (crowd.robots, crowd.points.shape, crowd.headings.shape) == ([], (0, 2), (0,))


class TestLooks:
    """How everybody looks."""

    def test_rings_tell_energy_faces_the_module_and_founders_the_family(
        self, heard: FakeTelemetry
    ) -> None:
        """Each in the order of the crowd, whatever the order in which they were heard."""
        heard.join(0, energy=0.0, module=0, agent=agent(0, 1))
        heard.join(1, energy=1.0, module=1, agent=agent(1, 1))
        heard.tell(0, born(agent(0, 1)))
        heard.tell(1, born(agent(1, 1)))
        heard.scene((1, 0.0, 0.0), (0, 0.5, 0.0))
        heard.pass_s(0.1)
        seen = looks(heard)
        assert rgb(seen.rings) == [palette.GOOD, palette.BAD]
        assert rgb(seen.faces) == [palette.MODULES[1], palette.MODULES[0]]
        assert rgb(seen.founders) == [palette.founder_colour(1), palette.founder_colour(0)]
        assert seen.stale == [False, False]

    def test_an_agent_without_a_known_birth_has_a_dim_founder(self, heard: FakeTelemetry) -> None:
        """Until its birth is heard of; another agent has a founder of its own."""
        heard.join(0, agent=agent(0, 1))
        heard.scene((0, 0.0, 0.0))
        heard.pass_s(0.1)
        of = LooksOf()
        assert rgb(looks(heard, of).founders) == [palette.DIM]
        heard.tell(0, born(agent(0, 1)), born(agent(0, 2)))
        for number in (1, 2, 1):
            heard.state(0, agent=agent(0, number))
            heard.pass_s(0.6)
            assert rgb(looks(heard, of).founders) == [palette.founder_colour(number - 1)]

    def test_who_is_silent_gone_or_unknown_is_grey(self, heard: FakeTelemetry) -> None:
        """In all three colours; the others are not."""
        heard.join(0, 1, 2)
        heard.go(1)
        heard.at_s += SILENT_AFTER_S + 0.1
        heard.state(1, 2)
        heard.scene((0, 0.0, 0.0), (1, 0.5, 0.0), (2, 0.0, 0.5), (3, 0.5, 0.5))
        heard.pass_s(0.1)
        seen = looks(heard)
        assert seen.stale == [True, True, False, True]
        for colours in (seen.rings, seen.faces, seen.founders):
            seen_grey = [colour == palette.STALE for colour in rgb(colours)]
            assert [seen_grey[robot] for robot in (0, 1, 3)] == [True] * 3
        assert rgb(seen.rings)[2] != palette.STALE

    def test_in_a_silent_arena_all_are_grey(self, heard: FakeTelemetry) -> None:
        """Nobody knows where they are; in another one they are not."""
        heard.join(0, 1)
        heard.scene((0, 0.0, 0.0), arena="a")
        heard.at_s += SILENT_AFTER_S + 0.1
        heard.scene((1, 0.0, 0.0), arena="b")
        heard.state(0, 1)
        heard.pass_s(0.1)
        assert looks(heard).stale == [True, False]

    def test_colours_are_looked_up_again_after_a_moment(
        self, heard: FakeTelemetry, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """Or at once when somebody else is there."""
        monkeypatch.setattr(crowd_module, "_LOOKS_S", 1.0)
        of = LooksOf()
        heard.join(0, 1, energy=0.0)
        heard.scene((0, 0.0, 0.0))
        heard.pass_s(0.1)
        first = looks(heard, of)
        heard.state(0, 1, energy=1.0)
        heard.pass_s(0.1)
        assert looks(heard, of) is first
        heard.scene((0, 0.0, 0.0), (1, 0.5, 0.0))
        heard.pass_s(0.1)
        assert rgb(looks(heard, of).rings) == [palette.GOOD, palette.GOOD]
        heard.state(0, 1, energy=0.0)
        heard.pass_s(1.0)
        assert rgb(looks(heard, of).rings) == [palette.BAD, palette.BAD]
