"""Scenes are drawn when they are new, at most ten times a second, and the status once a second."""

import pytest
from crcolony_dashboards.tabs import palette
from crcolony_dashboards.tabs.arena import ArenaTab
from crcolony_dashboards.tabs.arena_layout import ROOT

from crcolony.protocol.telemetry_messages import SILENT_AFTER_S
from tests.support.drawn import TabHarness

ROBOTS = [f"{ROOT}/{what}" for what in ("energy", "robots", "headings", "founders")]


@pytest.fixture
def show() -> TabHarness:
    """Two robots in an arena."""
    show = TabHarness(ArenaTab())
    show.sample.join(0, 1)
    show.sample.scene((0, -0.5, 0.0), (1, 0.5, 0.0))
    return show


class TestScenes:
    """A new scene is drawn once."""

    def test_nothing_is_drawn_again_when_nothing_is_new(self, show: TabHarness) -> None:
        """Only the words beside it, once a second, and the moment somebody falls silent."""
        assert set(ROBOTS) <= set(show.draw(0.1).paths())
        for _ in range(20):
            assert set(show.draw(0.05).paths()) <= {"/arena/now"}
        grey = [show.draw(0.1).times(f"{ROOT}/energy") for _ in range(40)]
        assert sum(grey) == 1
        assert show.streams.colours(f"{ROOT}/energy") == [palette.STALE] * 2

    def test_a_new_scene_is_drawn_at_the_next_moment(self, show: TabHarness) -> None:
        """At most ten times a second, however many there are."""
        drawn = 0
        for k in range(100):
            show.sample.scene((0, 0.001 * k, 0.0))
            drawn += show.draw(0.02).times(f"{ROOT}/robots")
        assert drawn == pytest.approx(20, abs=1)

    def test_before_an_arena_is_seen_nobody_is_drawn(self) -> None:
        """And who has gone with the arena is drawn no more."""
        show = TabHarness(ArenaTab())
        streams = show.draw(0.1)
        assert streams.shown(f"{ROOT}/robots", "positions") == []
        show.sample.scene((0, 0.0, 0.0))
        assert len(show.draw(0.1).shown(f"{ROOT}/robots", "positions")) == 1
        show.sample.forget_absent()
        assert show.draw(0.1).shown(f"{ROOT}/robots", "positions") == []


class TestTrails:
    """A point is left where everybody was."""

    def test_trails_are_left_unless_the_colony_leaps(self, show: TabHarness) -> None:
        """One that runs so fast has none."""
        streams = show.draw(0.2)
        assert streams.shown(f"{ROOT}/trails", "positions") == [[-0.5, 0.0], [0.5, 0.0]]
        show.sample.scene((0, 0.0, 0.0), tick=1_005)
        assert show.draw(0.2).shown(f"{ROOT}/trails", "positions") == [[0.0, 0.0]]
        show.sample.scene((0, 0.0, 0.0), tick=1_015)
        assert show.draw(0.2).shown(f"{ROOT}/trails", "positions") == []


class TestNow:
    """The colony in words, beside the picture."""

    def test_it_is_said_once_a_second(self, show: TabHarness) -> None:
        """Even if nothing can be seen."""
        said = [show.draw(0.1).times("/arena/now") for _ in range(40)]
        assert sum(said) == pytest.approx(4, abs=1)
        assert "2 robots online" in show.streams.text("/arena/now")

    def test_silence_is_seen(self, show: TabHarness) -> None:
        """Robots of an arena that says nothing any more are grey, though they speak."""
        show.draw(0.1)
        for _ in range(int(SILENT_AFTER_S) + 1):
            show.sample.state(0, 1)
            show.draw(1.0)
        assert show.streams.colours(f"{ROOT}/energy") == [palette.STALE] * 2
