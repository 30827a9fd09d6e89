"""Drawing of walls, battery packs, robots and their trails.

A robot is a disc in the colour of its module (its face) with a ring in the colour of its energy, and a small white disc
ahead of it that shows its heading. In the view by founder it is a disc in the colour of its agent's main founder.
"""

from collections.abc import Sequence

import numpy as np

from crcolony.protocol.telemetry_messages import Scene
from crcolony_dashboards.rerun_streams import RerunStreams
from crcolony_dashboards.tabs import palette
from crcolony_dashboards.tabs.arena_layout import ROOT
from crcolony_dashboards.tabs.robot_markers import (
    Points,
    RobotColours,
    RobotMarkers,
    arena_offsets_m,
)
from crcolony_dashboards.view_model.naming import NameLookup

FACE_SHARE = 0.68
"""Radius of the face, of the robot's; the rest is the ring"""
HEADING_SHARE = 0.22
"""Radius of the disc that shows the heading"""
HEADING_OFFSET = 1.25
"""How far it is from the robot's centre"""
_PACK_RADIUS_M = 0.035
_MIN_PACK_SHARE = 0.35
"""A pack's radius is at least this share of a robot's on the picture"""
_MAX_LABELS = 40
"""Up to so many robots their names are shown"""


def draw_walls(streams: RerunStreams, scenes: Sequence[Scene]) -> None:
    """Draw the walls of all arenas, with names if there are several, and scale the picture to them."""
    import rerun as rr

    corners = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5)])
    strips = [
        corners * (scene.width_m, scene.height_m) + np.array((offset_m, 0.0))
        for scene, offset_m in zip(scenes, arena_offsets_m(scenes), strict=True)
    ]
    streams.log(ROOT, scaled_to_view(np.concatenate(strips)))
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


def scaled_to_view(corners_m: Points) -> object:
    """Return the transform by which points between these corners reach from -1 to 1; Rerun's y axis points down."""
    import rerun as rr

    low_m, high_m = corners_m.min(axis=0), corners_m.max(axis=0)
    scale, middle_m = 2.0 / float((high_m - low_m).max()), 0.5 * (low_m + high_m)
    return rr.Transform3D(
        mat3x3=np.diag([scale, -scale, scale]),
        translation=[-scale * middle_m[0], scale * middle_m[1], 0.0],
    )


def draw_packs(streams: RerunStreams, scenes: Sequence[Scene], markers: RobotMarkers) -> None:
    """Draw all battery packs; empty ones are dark."""
    import rerun as rr

    packs = [
        (pack.x_m + offset_m, pack.y_m, pack.charge)
        for scene, offset_m in zip(scenes, arena_offsets_m(scenes), strict=True)
        for pack in scene.packs
    ]
    table = np.array(packs, dtype=float).reshape(-1, 3)
    colours = np.where(table[:, 2:] > 0.0, palette.PACK, palette.EMPTY_PACK)
    streams.log(
        f"{ROOT}/packs",
        rr.Points2D(
            table[:, :2],
            radii=max(_PACK_RADIUS_M, _MIN_PACK_SHARE * markers.radius_m),
            colors=colours.astype(np.uint8),
            draw_order=10.0,
        ),
    )


def draw_robots(
    streams: RerunStreams,
    scenes: Sequence[Scene],
    markers: RobotMarkers,
    colours: RobotColours,
    name_of: NameLookup,
) -> None:
    """Draw ring, face and heading of every robot, with the names of a few.

    With the faces the ticks of the scenes are logged, so that a recording says which scenes a picture shows.
    """
    import pyarrow as pa  # type: ignore[import-untyped]
    import rerun as rr

    is_labelled = len(markers.robots) <= _MAX_LABELS
    ahead = np.stack([np.cos(markers.headings), np.sin(markers.headings)], axis=-1)
    rings = rr.Points2D(
        markers.points, radii=markers.radius_m, colors=colours.energy, draw_order=20.0
    )
    faces = rr.Points2D(
        markers.points,
        radii=FACE_SHARE * markers.radius_m,
        colors=colours.module,
        labels=[name_of(robot) for robot in markers.robots] if is_labelled else None,
        show_labels=is_labelled,
        draw_order=21.0,
    )
    headings = rr.Points2D(
        markers.points + HEADING_OFFSET * markers.radius_m * ahead,
        radii=HEADING_SHARE * markers.radius_m,
        colors=[palette.INK],
        draw_order=22.0,
    )
    # Rerun refuses an empty array of numpy as being without a type
    ticks = pa.array([scene.tick for scene in scenes], pa.int64())
    streams.log(f"{ROOT}/energy", rings)
    streams.log(f"{ROOT}/robots", faces, rr.AnyValues(tick=ticks))
    streams.log(f"{ROOT}/headings", headings)


def draw_founders(streams: RerunStreams, markers: RobotMarkers, colours: RobotColours) -> None:
    """Draw every robot in the colour of its agent's main founder."""
    import rerun as rr

    discs = rr.Points2D(markers.points, radii=markers.radius_m, colors=colours.founder)
    streams.log(f"{ROOT}/founders", discs)


def draw_trails(streams: RerunStreams, markers: RobotMarkers, is_smooth: bool) -> None:
    """Draw a small point at every robot, of which the viewer shows those of the last seconds; none unless smooth."""
    import rerun as rr

    streams.log(
        f"{ROOT}/trails",
        rr.Points2D(
            markers.points if is_smooth else np.zeros((0, 2)),
            radii=0.08 * markers.radius_m,
            colors=[palette.DIM],
            draw_order=15.0,
        ),
    )
