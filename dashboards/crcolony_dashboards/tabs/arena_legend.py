"""The legend of the arena: every mark, drawn as in the arena, with what it means below it."""

from typing import TYPE_CHECKING

import numpy as np

from crcolony.robot.modules import MODULES
from crcolony_dashboards.rerun_streams import RerunStreams
from crcolony_dashboards.tabs import palette
from crcolony_dashboards.tabs.arena_bodies import FACE_SHARE, HEADING_OFFSET, HEADING_SHARE

if TYPE_CHECKING:
    import rerun.blueprint as rrb

LEGEND = "/arena/legend"
_R = 0.16
"""Radius of a robot, in units of the view"""
_GAP = 1.75
"""Between two marks"""
_ROW = 0.95
_ENERGIES = (0.0, 0.5, 1.0)
_FAN = np.linspace(-0.6, 0.6, 13)


def legend_view() -> "rrb.View":
    """Return the view of the legend."""
    import rerun.blueprint as rrb

    return rrb.Spatial2DView(
        origin=LEGEND,
        name="Legend: a robot is a face in a ring",
        background=palette.BACKGROUND,
        visual_bounds=rrb.VisualBounds2D(
            x_range=(-0.5 * _GAP, 6.5 * _GAP), y_range=(-0.3, 2.0 * _ROW - 0.4)
        ),
    )


def draw_legend(streams: RerunStreams) -> None:
    """Draw the legend, which never changes."""
    _draw_robots(streams)
    _draw_marks(streams)
    _draw_lines(streams)


def _draw_robots(streams: RerunStreams) -> None:
    """Draw the modules in control, the energies, a heading, and a robot without news."""
    modules = [module.name for module in MODULES]
    faces = [*palette.MODULES, *[palette.FAINT] * len(_ENERGIES), palette.MODULES[0], palette.STALE]
    levels = [tuple(colour) for colour in palette.energy_colours(_ENERGIES).tolist()]
    rings = [*[palette.FAINT] * len(modules), *levels, palette.FAINT, palette.STALE]
    texts = [
        *(f"face: {name}" for name in modules),
        *_energy_names(),
        "white ball:\nfront",
        "no news",
    ]
    places = np.array([(k * _GAP, 0.0) for k in range(len(texts))])
    _points(streams, "rings", places, _R, rings)
    _points(streams, "faces", places, FACE_SHARE * _R, faces)
    front = places[-2:-1] + np.array((HEADING_OFFSET * _R, 0.0))
    _points(streams, "fronts", front, HEADING_SHARE * _R, [palette.INK])
    _texts(streams, "robot_names", places + np.array((0.0, _R)), texts)


def _energy_names() -> list[str]:
    return ["ring: energy 0", "energy 0.5", "energy 1: full"]


def _draw_marks(streams: RerunStreams) -> None:
    """Draw a battery pack, an empty one, a trail and a camera's field of view."""
    import rerun as rr

    places = np.array([(0.0, _ROW), (_GAP, _ROW)])
    _points(streams, "packs", places, 0.5 * _R, [palette.PACK, palette.EMPTY_PACK])
    trail = np.array([(2.0 * _GAP + 0.12 * k, _ROW) for k in range(-2, 3)])
    _points(streams, "trail", trail, 0.02, [palette.DIM])
    eye = np.array([3.0 * _GAP - 0.25, _ROW])
    rim = eye + 0.5 * np.stack([np.cos(_FAN), 0.45 * np.sin(_FAN)], axis=-1)
    fan = rr.LineStrips2D(
        [np.vstack([eye, rim, eye])], radii=rr.Radius.ui_points(0.75), colors=[palette.SOFT]
    )
    streams.log(f"{LEGEND}/fan", fan, static=True)
    texts = ["battery pack", "empty pack", "path of 4 s", "fan: what it sees"]
    _texts(streams, "mark_names", [(k * _GAP, _ROW + _R) for k in range(len(texts))], texts)


def _draw_lines(streams: RerunStreams) -> None:
    """Draw the lines between two robots."""
    import rerun as rr

    starts = [(4 + k) * _GAP - 0.25 for k in range(3)]
    lines = rr.LineStrips2D(
        [[(x, _ROW), (x + 0.5, _ROW)] for x in starts],
        radii=rr.Radius.ui_points([1.0, 3.0, 3.0]),
        colors=[palette.MET, palette.MATED, palette.CONCEIVED],
    )
    streams.log(f"{LEGEND}/lines", lines, static=True)
    texts = ["they met", "they mated", "and conceived"]
    _texts(streams, "line_names", [(x + 0.25, _ROW + _R) for x in starts], texts)


def _points(
    streams: RerunStreams,
    name: str,
    places: np.ndarray,
    radius: float,
    colours: list[palette.Colour],
) -> None:
    import rerun as rr

    streams.log(f"{LEGEND}/{name}", rr.Points2D(places, radii=radius, colors=colours), static=True)


def _texts(streams: RerunStreams, name: str, places: object, texts: list[str]) -> None:
    import rerun as rr

    labels = rr.Points2D(
        np.asarray(places), labels=texts, radii=0.0, colors=[palette.SOFT], show_labels=True
    )
    streams.log(f"{LEGEND}/{name}", labels, static=True)
