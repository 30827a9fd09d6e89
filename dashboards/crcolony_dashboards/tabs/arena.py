"""The arena tab: positions, headings, energy and modules of all robots, battery packs, meetings and matings.

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
from crcolony_dashboards.tabs.arena_layout import STATUS, arena_layout
from crcolony_dashboards.tabs.arena_lines import ArenaLines
from crcolony_dashboards.tabs.robot_markers import ColourLookup, robot_markers
from crcolony_dashboards.throttle import ChangeDetector, Throttle
from crcolony_dashboards.view_model.colony_view import ColonyView
from crcolony_dashboards.view_model.status_text import format_status

if TYPE_CHECKING:
    import rerun.blueprint as rrb

_SCENE_PERIOD_S = 0.1
_TRAIL_PERIOD_S = 0.2
_STATUS_PERIOD_S = 1.0
_MAX_TRAIL_STEP_S = 1.5
"""Trails are drawn only if two scenes are closer than this in the colony's time"""


class ArenaTab:
    """Draws new scenes, at most ten a second."""

    def __init__(self) -> None:
        self._scene_throttle = Throttle(_SCENE_PERIOD_S)
        self._trail_throttle = Throttle(_TRAIL_PERIOD_S)
        self._status_throttle = Throttle(_STATUS_PERIOD_S)
        self._walls, self._packs = ChangeDetector(), ChangeDetector()
        self._drawn: object = None
        """Sequence numbers of the drawn scenes, and which robots are drawn as stale"""
        self._colours = ColourLookup()
        self._lines = ArenaLines()
        self._times_s: deque[float] = deque(maxlen=2)
        """The colony's time of the last two trail points"""

    def layout(self) -> "rrb.Container":
        """Return the layout of the tab."""
        return arena_layout()

    def setup(self, streams: RerunStreams) -> None:
        """Draw nothing: there is nothing before the first scene."""

    def draw(self, streams: RerunStreams, view: ColonyView, moment: Moment) -> None:
        """Draw the last scenes if they are new, lines between robots, and the status text."""
        if self._status_throttle.is_due(moment.unix_s):
            _draw_status(streams, view)
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


def _draw_status(streams: RerunStreams, view: ColonyView) -> None:
    import rerun as rr

    text = "\n".join(format_status(view))
    streams.log(STATUS, rr.TextDocument(text, media_type="text/markdown"))
