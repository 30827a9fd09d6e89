"""The first tab, the colony's story: the arena, what happened last, and what has evolved since the founders.

Of the arena positions, headings, energy and modules of all robots are drawn, battery packs, meetings and matings.
Several arenas are drawn side by side.
"""

from collections import deque
from collections.abc import Sequence
from typing import TYPE_CHECKING

from crcolony.protocol.telemetry_messages import Scene
from crcolony_dashboards.rerun_streams import Moment, RerunStreams
from crcolony_dashboards.tabs.arena_bodies import (
    draw_founders,
    draw_packs,
    draw_robots,
    draw_trails,
    draw_walls,
)
from crcolony_dashboards.tabs.arena_layout import arena_view
from crcolony_dashboards.tabs.arena_legend import draw_legend, legend_view
from crcolony_dashboards.tabs.arena_lines import ArenaLines
from crcolony_dashboards.tabs.colony_story import ColonyStory
from crcolony_dashboards.tabs.robot_markers import ColourLookup, robot_markers
from crcolony_dashboards.throttle import ChangeDetector, Throttle
from crcolony_dashboards.view_model.colony_view import ColonyView

if TYPE_CHECKING:
    import rerun.blueprint as rrb

_SCENE_PERIOD_S = 0.1
_TRAIL_PERIOD_S = 0.2
_MAX_TRAIL_STEP_S = 1.5
"""Trails are drawn only if two scenes are closer than this in the colony's time"""


class ColonyTab:
    """Draws new scenes, at most ten a second, and the story beside them once a second."""

    def __init__(self) -> None:
        self._scene_throttle = Throttle(_SCENE_PERIOD_S)
        self._trail_throttle = Throttle(_TRAIL_PERIOD_S)
        self._story = ColonyStory()
        self._walls, self._packs = ChangeDetector(), ChangeDetector()
        self._drawn: object = None
        """Sequence numbers of the drawn scenes, and which robots are drawn as stale"""
        self._colours = ColourLookup()
        self._lines = ArenaLines()
        self._times_s: deque[float] = deque(maxlen=2)
        """The colony's time of the last two trail points"""

    def layout(self) -> "rrb.Container":
        """Return the layout of the tab."""
        import rerun.blueprint as rrb

        return rrb.Horizontal(
            rrb.Vertical(arena_view(), legend_view(), row_shares=[4.2, 1]),
            self._story.layout(),
            column_shares=[1.15, 1],
            name="Colony",
        )

    def setup(self, streams: RerunStreams) -> None:
        """Draw the legend."""
        draw_legend(streams)

    def draw(self, streams: RerunStreams, view: ColonyView, moment: Moment) -> None:
        """Draw the last scenes if they are new, lines between robots, and the story."""
        self._story.draw(streams, view, moment)
        if not self._scene_throttle.is_due(moment.unix_s):
            return
        scenes = view.scenes()
        markers = robot_markers(scenes)
        colours = self._colours.colours(view, markers, moment.unix_s)
        latest = ({scene.arena: scene.seq for scene in scenes}, colours.is_stale)
        if latest != self._drawn:
            self._drawn = latest
            walls = [(scene.arena, scene.width_m, scene.height_m) for scene in scenes]
            if scenes and self._walls.is_due(walls, moment.unix_s):
                draw_walls(streams, scenes)
            if self._packs.is_due([scene.packs for scene in scenes], moment.unix_s):
                draw_packs(streams, scenes, markers)
            draw_robots(streams, scenes, markers, colours, view.name_of)
            self._lines.draw_camera_fields(streams, view, markers)
            if self._trail_throttle.is_due(moment.unix_s):
                draw_founders(streams, markers, colours)
                draw_trails(streams, markers, self._is_smooth(scenes))
        self._lines.draw_pairings(streams, view, markers, moment.unix_s)

    def _is_smooth(self, scenes: Sequence[Scene]) -> bool:
        """Return whether little of the colony's time has passed since the last call."""
        self._times_s.append(scenes[0].tick * scenes[0].period_s if scenes else 0.0)
        return 0.0 <= self._times_s[-1] - self._times_s[0] <= _MAX_TRAIL_STEP_S
