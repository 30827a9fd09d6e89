"""Scenes are drawn when they are new, at most ten times a second."""

import pytest
from crcolony_dashboards.tabs import palette
from crcolony_dashboards.tabs.arena_layout import ROOT
from crcolony_dashboards.tabs.colony import ColonyTab

from crcolony.protocol.telemetry_messages import SILENT_AFTER_S
from tests.support.drawn import TabHarness

ROBOTS = [f"{ROOT}/{what}" for what in ("energy", "robots", "headings", "founders")]


@pytest.fixture
def show() -> TabHarness:
    """Two robots in an arena."""
    show = TabHarness(ColonyTab())
    show.telemetry.join(0, 1)
    show.telemetry.scene((0, -0.5, 0.0), (1, 0.5, 0.0))
    return show


class TestScenes:
    """A new scene is drawn once."""

    def test_nothing_is_drawn_again_when_nothing_is_new(self, show: TabHarness) -> None:
        """The robots once when they become stale."""
        assert set(ROBOTS) <= set(show.draw(0.1).paths())
        for _ in range(20):
            assert not any(path.startswith(ROOT) for path in show.draw(0.05).paths())
        grey = [show.draw(0.1).times(f"{ROOT}/energy") for _ in range(40)]
        assert sum(grey) == 1
        assert show.streams.colours(f"{ROOT}/energy") == [palette.STALE] * 2

    def test_new_scenes_are_drawn_at_most_ten_times_a_second(self, show: TabHarness) -> None:
        """However many arrive."""
        drawn = 0
        for k in range(100):
            show.telemetry.scene((0, 0.001 * k, 0.0))
            drawn += show.draw(0.02).times(f"{ROOT}/robots")
        assert drawn == pytest.approx(20, abs=1)

    def test_without_a_scene_no_robot_is_drawn(self) -> None:
        """Neither before the first scene nor after its arena was removed."""
        show = TabHarness(ColonyTab())
        streams = show.draw(0.1)
        assert streams.shown(f"{ROOT}/robots", "positions") == []
        show.telemetry.scene((0, 0.0, 0.0))
        assert len(show.draw(0.1).shown(f"{ROOT}/robots", "positions")) == 1
        show.telemetry.remove_absent()
        assert show.draw(0.1).shown(f"{ROOT}/robots", "positions") == []


class TestTrails:
    """A point remains where a robot was."""

    def test_trails_are_drawn_unless_much_time_lies_between_scenes(self, show: TabHarness) -> None:
        """A colony that runs much faster than real time has none."""
        streams = show.draw(0.2)
        assert streams.shown(f"{ROOT}/trails", "positions") == [[-0.5, 0.0], [0.5, 0.0]]
        show.telemetry.scene((0, 0.0, 0.0), tick=1_005)
        assert show.draw(0.2).shown(f"{ROOT}/trails", "positions") == [[0.0, 0.0]]
        show.telemetry.scene((0, 0.0, 0.0), tick=1_015)
        assert show.draw(0.2).shown(f"{ROOT}/trails", "positions") == []


class TestStaleScenes:
    """An arena that is silent."""

    def test_robots_of_a_silent_arena_are_drawn_grey(self, show: TabHarness) -> None:
        """Even though the robots themselves publish states."""
        show.draw(0.1)
        for _ in range(int(SILENT_AFTER_S) + 1):
            show.telemetry.state(0, 1)
            show.draw(1.0)
        assert show.streams.colours(f"{ROOT}/energy") == [palette.STALE] * 2
