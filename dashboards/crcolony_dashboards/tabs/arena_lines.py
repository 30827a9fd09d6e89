"""Drawing of lines in the arena: cameras' fields of view, and lines between robots that have just met or mated."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from crcolony.protocol.telemetry_messages import Scene
from crcolony.telemetry.peer_settings import PeerSettings
from crcolony_dashboards.rerun_streams import RerunStreams
from crcolony_dashboards.tabs import palette
from crcolony_dashboards.tabs.arena_layout import ROOT
from crcolony_dashboards.tabs.robot_markers import Points, RobotMarkers, arena_offsets_m
from crcolony_dashboards.view_model.colony_view import ColonyView
from crcolony_dashboards.view_model.pairings import MATING_S, MEETING_S

_MAX_CAMERA_FIELDS = 8
"""Up to so many robots the fields of view of their cameras are drawn"""
_ARC = np.linspace(-1.0, 1.0, 41)
"""Directions of a field of view, in half angles"""


@dataclass
class _Lines:
    """Lines of one kind."""

    strips: list[Points] = field(default_factory=list)
    colours: list[palette.Colour] = field(default_factory=list)

    def add(self, strip: Points, colour: palette.Colour) -> None:
        self.strips.append(strip)
        self.colours.append(colour)


class ArenaLines:
    """Draws lines in place of the earlier ones of their kind."""

    def __init__(self) -> None:
        self._settings = PeerSettings()
        self._shown: set[str] = set()
        """The kinds of which lines are visible"""

    def draw_camera_fields(
        self, streams: RerunStreams, view: ColonyView, markers: RobotMarkers
    ) -> None:
        """Draw what the cameras see if there are few robots, in arenas whose settings are known."""
        fields = _Lines()
        if len(markers.robots) <= _MAX_CAMERA_FIELDS:
            offsets_m = arena_offsets_m(view.scenes())
            for arena, offset_m in zip(view.arenas, offsets_m, strict=True):
                body = self._settings.of_arena(arena.metadata)
                if body is None or not body.camera or arena.scene is None:
                    continue
                for robot in arena.scene.robots:
                    eye = np.array((robot.x_m, robot.y_m))
                    angles = robot.heading_rad + body.camera_half_angle_rad * _ARC
                    rim = field_rim(eye, angles, body.camera_range_m, arena.scene)
                    outline = np.vstack([eye, rim, eye]) + np.array((offset_m, 0.0))
                    fields.add(outline, palette.FAINT)
        self._draw(streams, "camera_fields", fields, width=0.75, order=5.0)

    def draw_pairings(
        self, streams: RerunStreams, view: ColonyView, markers: RobotMarkers, unix_s: float
    ) -> None:
        """Draw lines between robots that have just met or mated, and remove them when their time is over."""
        points = dict(zip(markers.robots, markers.points, strict=True)) if view.pairings else {}
        meetings, matings = _Lines(), _Lines()
        for pairing in view.pairings:
            one, other = (points.get(robot) for robot in pairing.robots)
            is_over = unix_s - pairing.unix_s > (MATING_S if pairing.mated else MEETING_S)
            if one is None or other is None or is_over:
                continue
            line = np.stack([one, other])
            if pairing.mated:
                matings.add(line, palette.CONCEIVED if pairing.conceived else palette.MATED)
            else:
                meetings.add(line, palette.MET)
        self._draw(streams, "meetings", meetings, width=1.0, order=29.0)
        self._draw(streams, "matings", matings, width=3.0, order=30.0)

    def _draw(
        self, streams: RerunStreams, kind: str, lines: _Lines, width: float, order: float
    ) -> None:
        """Replace the visible lines of a kind; log nothing if there are none and were none."""
        import rerun as rr

        if not lines.strips and kind not in self._shown:
            return
        if lines.strips:
            self._shown.add(kind)
        else:
            self._shown.discard(kind)
        strips = rr.LineStrips2D(
            lines.strips,
            radii=rr.Radius.ui_points(width),
            colors=palette.colour_array(lines.colours),
            draw_order=order,
        )
        streams.log(f"{ROOT}/{kind}", strips)


def field_rim(
    eye: NDArray[np.float64], angles: NDArray[np.float64], range_m: float, scene: Scene
) -> Points:
    """Return the points, (n, 2), where a camera's view from `eye`, (2,), ends: at its range or the arena's wall."""
    ahead = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    half_m = 0.5 * np.array([scene.width_m, scene.height_m])
    steps = np.where(np.abs(ahead) < 1e-9, 1e-9, ahead)
    to_wall = np.where(ahead > 0.0, half_m - eye, -half_m - eye) / steps
    distances_m = np.clip(np.abs(to_wall).min(axis=-1), 0.0, range_m)
    return np.asarray(eye + ahead * distances_m[:, None])
