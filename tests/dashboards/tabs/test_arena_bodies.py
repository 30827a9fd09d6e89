"""Walls, packs and robots are drawn where the arena says, with y up."""

import numpy as np
import pytest
from crcolony_dashboards.tabs import palette
from crcolony_dashboards.tabs.arena_bodies import scaled_to_view
from crcolony_dashboards.tabs.arena_layout import ROOT
from crcolony_dashboards.tabs.colony import ColonyTab
from hypothesis import given
from hypothesis import strategies as st

from tests.support.drawn import RecordingStreams, TabHarness


@pytest.fixture
def show() -> TabHarness:
    """Two robots in an arena."""
    show = TabHarness(ColonyTab())
    show.telemetry.join(0, 1)
    show.telemetry.scene((0, -0.5, 0.0), (1, 0.5, 0.0))
    return show


def lines(streams: RecordingStreams, kind: str) -> list[list[list[float]]]:
    return streams.shown(f"{ROOT}/{kind}", "strips")


class TestScale:
    """The picture reaches from -1 to 1, with y up."""

    @given(
        st.floats(0.01, 1e4), st.floats(0.01, 1e4), st.floats(-1e3, 1e3), st.floats(-1e3, 1e3)
    )  # fmt: skip
    def test_the_longer_side_reaches_from_edge_to_edge(
        self, width_m: float, height_m: float, x_m: float, y_m: float
    ) -> None:
        """The shorter side is scaled alike, and the centre is in the middle."""
        corners = np.array([(x_m, y_m), (x_m + width_m, y_m + height_m)])
        streams = RecordingStreams()
        streams.log(ROOT, scaled_to_view(corners))
        # Rerun keeps a matrix column by column
        matrix = np.array(streams.shown(ROOT, "mat3x3")[0]).reshape(3, 3).T
        shift = np.array(streams.shown(ROOT, "translation")[0])
        low, high = (matrix @ np.array([*corner, 0.0]) + shift for corner in corners)
        longer = max(width_m, height_m)
        precision = 1e-6 * max(1.0, 10.0 * max(abs(x_m), abs(y_m)) / longer)
        # a picture counts from its top: what is low in the arena is far down in it
        assert low[:2] == pytest.approx([-width_m / longer, height_m / longer], abs=precision)
        assert high[:2] == pytest.approx([width_m / longer, -height_m / longer], abs=precision)


class TestRobots:
    """Robots and packs have the positions and colours that were published."""

    def test_robots_are_where_the_arena_says(self, show: TabHarness) -> None:
        """Ring, face and founder disc are at the robot's position, the heading disc ahead; names are shown."""
        show.telemetry.scene((0, -0.5, 0.25, 0.5 * np.pi), (1, 0.5, 0.0))
        streams = show.draw(0.1)
        for what in ("energy", "robots", "founders"):
            assert streams.shown(f"{ROOT}/{what}", "positions") == [[-0.5, 0.25], [0.5, 0.0]]
        assert streams.shown(f"{ROOT}/robots", "labels") == ["#0", "#1"]
        nose, _ = streams.shown(f"{ROOT}/headings", "positions")
        assert nose == pytest.approx([-0.5, 0.25 + 1.25 * 0.11])
        assert len(streams.colours(f"{ROOT}/energy")) == 2

    def test_a_face_is_drawn_on_its_ring(self, show: TabHarness) -> None:
        """The ring is as large as the robot and visible around the face."""
        streams = show.draw(0.1)
        (ring,), (face,), (founder,) = (
            streams.shown(f"{ROOT}/{what}", "radii") for what in ("energy", "robots", "founders")
        )
        assert ring == founder == pytest.approx(0.11)
        assert 0.5 * ring < face < 0.8 * ring
        (low,), (high,) = (
            streams.shown(f"{ROOT}/{what}", "draw_order") for what in ("energy", "robots")
        )
        assert low < high

    def test_names_of_many_robots_are_hidden(self, show: TabHarness) -> None:
        """Also names that were shown before."""
        show.telemetry.scene(*((k, 0.01 * k, 0.0) for k in range(40)))
        streams = show.draw(0.1)
        assert streams.shown(f"{ROOT}/robots", "show_labels") == [True]
        assert len(streams.shown(f"{ROOT}/robots", "labels")) == 40
        show.telemetry.scene(*((k, 0.01 * k, 0.0) for k in range(41)))
        streams = show.draw(0.1)
        assert streams.shown(f"{ROOT}/robots", "show_labels") == [False]
        assert len(streams.shown(f"{ROOT}/robots", "positions")) == 41

    def test_the_ticks_of_the_scenes_are_logged_with_the_robots(self, show: TabHarness) -> None:
        """One for every arena, in their order: a recording says which scenes a picture shows."""
        show.telemetry.scene((2, 0.0, 0.0), arena="attic", tick=7)
        assert show.draw(0.1).shown(f"{ROOT}/robots", "tick") == [7, 1000]

    def test_packs_are_where_the_arena_says(self, show: TabHarness) -> None:
        """An empty pack is dark; in a large arena packs are drawn larger."""
        show.telemetry.scene(packs=[(0.5, 0.5, 0.4), (-0.5, 0.5, 0.0)])
        streams = show.draw(0.1)
        assert streams.shown(f"{ROOT}/packs", "positions") == [[0.5, 0.5], [-0.5, 0.5]]
        assert streams.colours(f"{ROOT}/packs") == [palette.PACK, palette.EMPTY_PACK]
        (small,) = streams.shown(f"{ROOT}/packs", "radii")
        show.telemetry.scene(packs=[(0.5, 0.5, 0.4)], width_m=100.0)
        (large,) = show.draw(0.1).shown(f"{ROOT}/packs", "radii")
        assert (small, large) == pytest.approx((0.35 * 0.11, 0.35 * 0.55))


class TestWalls:
    """Arenas have walls, and names if there are several."""

    def test_walls_are_drawn_when_they_change(self, show: TabHarness) -> None:
        """And scaled to the view."""
        streams = show.draw(0.1)
        (wall,) = lines(streams, "walls")
        assert wall == [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]]
        show.telemetry.scene((0, 0.0, 0.0))
        assert show.draw(0.1).times(f"{ROOT}/walls") == 0
        show.telemetry.scene((0, 0.0, 0.0), width_m=4.0)
        streams = show.draw(0.1)
        assert (streams.times(f"{ROOT}/walls"), streams.times(ROOT)) == (1, 1)

    def test_several_arenas_have_names(self, show: TabHarness) -> None:
        """A single arena has none, also after the others were removed."""
        show.telemetry.scene((2, 0.0, 0.0), arena="attic")
        streams = show.draw(0.1)
        assert len(lines(streams, "walls")) == 2
        assert streams.shown(f"{ROOT}/walls", "labels") == ["attic", "lab"]
        assert streams.shown(f"{ROOT}/walls", "show_labels") == [True]
        show.telemetry.remove_absent()
        show.telemetry.scene((0, 0.0, 0.0))
        streams = show.draw(0.1)
        assert len(lines(streams, "walls")) == 1
        assert streams.shown(f"{ROOT}/walls", "labels") == []
