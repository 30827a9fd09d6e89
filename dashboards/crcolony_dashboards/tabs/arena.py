"""The arena: who is where, looks whither, is how hungry, does what, and has just met or mated with whom.

A robot is a disc in the colour of its module (left) or of its agent's main founder (right), with a ring in the colour
of its energy, and a nose: a small white disc ahead of it. Several arenas stand side by side.
"""

from collections import deque
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from crcolony.protocol.telemetry_messages import Scene
from crcolony.telemetry.peer_settings import PeerSettings
from crcolony_dashboards.rerun_streams import Moment, RerunStreams
from crcolony_dashboards.tabs import palette
from crcolony_dashboards.tabs.robot_markers import (
    Crowd,
    Looks,
    LooksOf,
    Points,
    crowd_of,
    offsets_m,
)
from crcolony_dashboards.throttle import ChangeDetector, Throttle
from crcolony_dashboards.view_model.colony_view import MATING_S, MEETING_S, ColonyView
from crcolony_dashboards.view_model.status_text import now_in_words

if TYPE_CHECKING:
    import rerun.blueprint as rrb

ROOT = "/arena/world"
_VIEW = 1.08
"""What the view shows, of a picture that reaches from -1 to 1"""
_FACE = 0.68
"""Of a robot's radius; the rest is the ring"""
_PACK_M, _PACK = 0.035, 0.35
"""A pack's radius, and at least so much of a robot's on the picture"""
_LABELLED, _FIELDS = 40, 8
"""Up to so many robots have their names, and their camera fields, drawn"""
_TRAIL_S = 4.0
_JUMP_S = 1.5
"""Of the colony's time between two scenes; in a colony that runs faster than that there are no trails"""
_ARC = np.linspace(-1.0, 1.0, 41)


class ArenaTab:
    """Draws scenes as they come, at the pace of the arena (ten a second)."""

    def __init__(self) -> None:
        self._often, self._at_times, self._seldom = Throttle(0.1), Throttle(0.2), Throttle(1.0)
        self._drawn: object = None
        self._frame, self._packs = ChangeDetector(), ChangeDetector()
        self._looks, self._settings = LooksOf(), PeerSettings()
        self._times_s: deque[float] = deque(maxlen=2)
        self._has_lines: set[str] = set()

    def layout(self) -> "rrb.Container":
        """Return the place of the arena: large by module, smaller by founder, and the colony in words."""
        import rerun.blueprint as rrb

        bounds = rrb.VisualBounds2D(x_range=(-_VIEW, _VIEW), y_range=(-_VIEW, _VIEW))
        trail = [
            rrb.VisibleTimeRange(
                timeline,
                start=rrb.TimeRangeBoundary.cursor_relative(seconds=-_TRAIL_S),
                end=rrb.TimeRangeBoundary.cursor_relative(),
            )
            for timeline in ("wall", "sim")
        ]
        return rrb.Horizontal(
            rrb.Spatial2DView(
                origin="/arena",
                contents=[f"+ {ROOT}/**", f"- {ROOT}/founders"],
                name="Arena: face foraging blue, mating pink; ring hungry red to full green",
                background=palette.BACKGROUND,
                visual_bounds=bounds,
                overrides={f"{ROOT}/trails": [rrb.VisibleTimeRanges(trail)]},
            ),
            rrb.Vertical(
                rrb.TextDocumentView(origin="/arena/now", name="Now"),
                rrb.Spatial2DView(
                    origin="/arena",
                    contents=[f"+ {ROOT}/walls", f"+ {ROOT}/founders"],
                    name="By founder of the agent in control",
                    background=palette.BACKGROUND,
                    visual_bounds=bounds,
                ),
            ),
            column_shares=[2.2, 1],
            name="Arena",
        )

    def setup(self, streams: RerunStreams) -> None:
        """Nothing is there before an arena is seen."""

    def draw(self, streams: RerunStreams, view: ColonyView, moment: Moment) -> None:
        """Draw everybody where they are now, if there is anything new."""
        if self._seldom.is_due(moment.unix_s):
            self._draw_now(streams, view, moment)
        if not self._often.is_due(moment.unix_s):
            return
        scenes = view.scenes()
        crowd = crowd_of(scenes)
        looks = self._looks.of(view, crowd, moment.unix_s)
        latest = ({scene.arena: scene.seq for scene in scenes}, looks.stale)
        if latest != self._drawn:
            self._drawn = latest
            self._draw_frame(streams, scenes, moment)
            if self._packs.is_due([scene.packs for scene in scenes], moment.unix_s):
                self._draw_packs(streams, scenes, crowd)
            self._draw_robots(streams, view, crowd, looks)
            self._draw_fields(streams, view, crowd)
            if self._at_times.is_due(moment.unix_s):
                self._draw_founders(streams, crowd, looks)
                self._draw_trails(streams, scenes, crowd)
        self._draw_pairings(streams, view, crowd, moment)

    def _draw_frame(self, streams: RerunStreams, scenes: Sequence[Scene], moment: Moment) -> None:
        """Draw walls when they have changed, and fit them into the view; y points up, as in the arena."""
        import rerun as rr

        frame = [(scene.arena, scene.width_m, scene.height_m) for scene in scenes]
        if not scenes or not self._frame.is_due(frame, moment.unix_s):
            return
        corners = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5)])
        strips = [
            corners * (scene.width_m, scene.height_m) + np.array((offset_m, 0.0))
            for scene, offset_m in zip(scenes, offsets_m(scenes), strict=True)
        ]
        streams.log(ROOT, fit(np.concatenate(strips)))
        streams.log(
            f"{ROOT}/walls",
            rr.LineStrips2D(
                strips,
                radii=rr.Radius.ui_points(2.5),
                colors=[palette.DIM] * len(strips),
                labels=[scene.arena for scene in scenes] if len(scenes) > 1 else [],
                show_labels=True,
                draw_order=1.0,
            ),
        )

    @staticmethod
    def _draw_packs(streams: RerunStreams, scenes: Sequence[Scene], crowd: Crowd) -> None:
        import rerun as rr

        packs = [
            (pack.x_m + offset_m, pack.y_m, pack.charge)
            for scene, offset_m in zip(scenes, offsets_m(scenes), strict=True)
            for pack in scene.packs
        ]
        table = np.array(packs, dtype=float).reshape(-1, 3)
        colours = np.where(table[:, 2:] > 0.0, palette.PACK, palette.EMPTY_PACK)
        streams.log(
            f"{ROOT}/packs",
            rr.Points2D(
                table[:, :2],
                radii=max(_PACK_M, _PACK * crowd.radius_m),
                colors=colours.astype(np.uint8),
                draw_order=10.0,
            ),
        )

    @staticmethod
    def _draw_robots(streams: RerunStreams, view: ColonyView, crowd: Crowd, looks: Looks) -> None:
        import rerun as rr

        is_labelled = len(crowd.robots) <= _LABELLED
        ahead = np.stack([np.cos(crowd.headings), np.sin(crowd.headings)], axis=-1)
        discs = rr.Points2D(crowd.points, radii=crowd.radius_m, colors=looks.rings, draw_order=20.0)
        faces = rr.Points2D(
            crowd.points,
            radii=_FACE * crowd.radius_m,
            colors=looks.faces,
            labels=[view.call(robot) for robot in crowd.robots] if is_labelled else None,
            show_labels=is_labelled,
            draw_order=21.0,
        )
        headings = rr.Points2D(
            crowd.points + 1.25 * crowd.radius_m * ahead,
            radii=0.22 * crowd.radius_m,
            colors=[palette.INK],
            draw_order=22.0,
        )
        streams.log(f"{ROOT}/energy", discs)
        streams.log(f"{ROOT}/robots", faces)
        streams.log(f"{ROOT}/headings", headings)

    @staticmethod
    def _draw_founders(streams: RerunStreams, crowd: Crowd, looks: Looks) -> None:
        import rerun as rr

        discs = rr.Points2D(crowd.points, radii=crowd.radius_m, colors=looks.founders)
        streams.log(f"{ROOT}/founders", discs)

    def _draw_trails(self, streams: RerunStreams, scenes: Sequence[Scene], crowd: Crowd) -> None:
        """Leave a small point where everybody is; the viewer shows those of the last seconds."""
        import rerun as rr

        self._times_s.append(scenes[0].tick * scenes[0].period_s if scenes else 0.0)
        is_smooth = 0.0 <= self._times_s[-1] - self._times_s[0] <= _JUMP_S
        streams.log(
            f"{ROOT}/trails",
            rr.Points2D(
                crowd.points if is_smooth else np.zeros((0, 2)),
                radii=0.08 * crowd.radius_m,
                colors=[palette.DIM],
                draw_order=15.0,
            ),
        )

    def _draw_fields(self, streams: RerunStreams, view: ColonyView, crowd: Crowd) -> None:
        """Draw what the cameras of a few robots see, as far as their arena has told it."""
        strips: list[Points] = []
        if len(crowd.robots) <= _FIELDS:
            shifts_m = offsets_m(view.scenes())
            for arena, shift_m in zip(view.arenas, shifts_m, strict=True):
                body = self._settings.of_arena(arena.metadata)
                if body is None or not body.camera or arena.scene is None:
                    continue
                for seen in arena.scene.robots:
                    eye = np.array((seen.x_m, seen.y_m))
                    angles = seen.heading_rad + body.camera_half_angle_rad * _ARC
                    rim = field_rim(eye, angles, body.camera_range_m, arena.scene)
                    strips.append(np.vstack([eye, rim, eye]) + np.array((shift_m, 0.0)))
        colours = [palette.FAINT] * len(strips)
        self._draw_lines(streams, "camera_fields", strips, colours, width=0.75, order=5.0)

    def _draw_pairings(
        self, streams: RerunStreams, view: ColonyView, crowd: Crowd, moment: Moment
    ) -> None:
        """Draw lines between who has just met or mated; take them away again a moment later."""
        where = dict(zip(crowd.robots, crowd.points, strict=True)) if view.pairings else {}
        meetings: list[Points] = []
        matings: list[Points] = []
        colours: list[palette.Colour] = []
        for pairing in view.pairings:
            one, other = (where.get(robot) for robot in pairing.robots)
            is_over = moment.unix_s - pairing.unix_s > (MATING_S if pairing.mated else MEETING_S)
            if one is None or other is None or is_over:
                continue
            if pairing.mated:
                matings.append(np.stack([one, other]))
                colours.append(palette.CONCEIVED if pairing.conceived else palette.MATED)
            else:
                meetings.append(np.stack([one, other]))
        self._draw_lines(streams, "meetings", meetings, [palette.MET] * len(meetings), 1.0, 29.0)
        self._draw_lines(streams, "matings", matings, colours, 3.0, 30.0)

    def _draw_lines(
        self,
        streams: RerunStreams,
        kind: str,
        lines: list[Points],
        colours: list[palette.Colour],
        width: float,
        order: float,
    ) -> None:
        """Draw lines in place of those of the same kind that were there; nothing if there are and were none."""
        import rerun as rr

        if lines or kind in self._has_lines:
            (self._has_lines.add if lines else self._has_lines.discard)(kind)
            radius = rr.Radius.ui_points(width)
            strips = rr.LineStrips2D(
                lines, radii=radius, colors=palette.colours(colours), draw_order=order
            )
            streams.log(f"{ROOT}/{kind}", strips)

    @staticmethod
    def _draw_now(streams: RerunStreams, view: ColonyView, moment: Moment) -> None:
        import rerun as rr

        text = "\n".join(now_in_words(view))
        streams.log("/arena/now", rr.TextDocument(text, media_type="text/markdown"))


def fit(corners_m: Points) -> object:
    """Return what scales a picture with these corners to reach from -1 to 1, with y up; pictures have it down."""
    import rerun as rr

    low_m, high_m = corners_m.min(axis=0), corners_m.max(axis=0)
    scale, middle_m = 2.0 / float((high_m - low_m).max()), 0.5 * (low_m + high_m)
    return rr.Transform3D(
        mat3x3=np.diag([scale, -scale, scale]),
        translation=[-scale * middle_m[0], scale * middle_m[1], 0.0],
    )


def field_rim(
    eye: NDArray[np.float64], angles: NDArray[np.float64], range_m: float, scene: Scene
) -> Points:
    """Return where a camera's view from a point (2,) ends in each direction: at the latest at the arena's wall."""
    ahead = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    half_m = 0.5 * np.array([scene.width_m, scene.height_m])
    steps = np.where(np.abs(ahead) < 1e-9, 1e-9, ahead)
    to_wall = np.where(ahead > 0.0, half_m - eye, -half_m - eye) / steps
    far_m = np.clip(np.abs(to_wall).min(axis=-1), 0.0, range_m)
    return np.asarray(eye + ahead * far_m[:, None])
