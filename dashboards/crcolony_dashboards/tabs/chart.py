"""A line chart over generations, with axes of its own: those of Rerun's plots are always the time that is shown.

Every line carries its name at its end. Without lines there is a message, in words, of what is waited for.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from crcolony.compiled import FloatArray
from crcolony_dashboards.rerun_streams import RerunStreams
from crcolony_dashboards.tabs import palette

if TYPE_CHECKING:
    import rerun.blueprint as rrb

_HEIGHT = 1.0
"""Of the plotted area, in units of its view"""
_LEFT, _RIGHT, _TOP, _BOTTOM = 0.22, 0.72, 0.1, 0.24
"""Margins for numbers, and at the right for the names of lines"""
_TICKS = 5
"""At most so many numbers on an axis, about"""
_MIN_GAP = 0.13
"""Between the names of two lines"""
_RAISE_PX = 10.0
"""Rerun draws a label so far below its point"""
_MAX_VALUE = 1e12
"""A larger value is not drawn"""


@dataclass(frozen=True, eq=False)
class Line:
    """One line of a chart."""

    name: str
    """Empty for none: of a line that belongs to another one"""
    colour: palette.Colour
    points: FloatArray
    """(n, 2) generation and value"""
    width: float = 1.8
    """In pixels"""


class Chart:
    """A chart below the entity `path`; `width` is that of the plotted area, whose height is 1.

    `height_px` is about that height on the screen. `top` is the highest value of its axis, which begins at 0; None if
    the axis follows the lines.
    """

    def __init__(
        self, path: str, title: str, width: float, height_px: float, top: float | None = None
    ) -> None:
        self.path, self._title, self._width, self._top = path, title, width, top
        self._raise = _RAISE_PX / height_px

    def layout(self) -> "rrb.View":
        """Return the view of the chart."""
        import rerun.blueprint as rrb

        return rrb.Spatial2DView(
            origin=self.path,
            name=self._title,
            background=palette.BACKGROUND,
            visual_bounds=rrb.VisualBounds2D(
                x_range=(-_LEFT, self._width + _RIGHT), y_range=(-_HEIGHT - _TOP, _BOTTOM)
            ),
        )

    def draw(self, streams: RerunStreams, lines: Sequence[Line], message: str = "") -> None:
        """Draw lines with their axes, or the message if there are none."""
        import rerun as rr

        lines = [line for line in map(_plausible, lines) if len(line.points)]
        if not lines:
            streams.log(self.path, rr.Clear(recursive=True))
            self._draw_labels(streams, "message", [(0.5 * self._width, -0.55)], [message])
            return
        streams.log(f"{self.path}/message", rr.Clear(recursive=False))
        points = np.concatenate([line.points for line in lines])
        xs = ticks(points[:, 0].min(), points[:, 0].max(), is_whole=True)
        low, high = points[:, 1].min(), points[:, 1].max()
        ys = ticks(min(0.0, low), high if self._top is None else max(high, self._top))
        self._draw_axes(streams, xs, ys)
        scaled = [self._scaled(line.points, xs, ys) for line in lines]
        streams.log(
            f"{self.path}/lines",
            rr.LineStrips2D(
                scaled,
                colors=[line.colour for line in lines],
                radii=rr.Radius.ui_points([0.5 * line.width for line in lines]),
                draw_order=10.0,
            ),
        )
        named = [k for k, line in enumerate(lines) if line.name]
        heights = spread_out([float(scaled[k][-1, 1]) for k in named], _MIN_GAP)
        places = [(self._width + 0.5 * _RIGHT, y - self._raise) for y in heights]
        texts = [f"{lines[k].name} {format_number(lines[k].points[-1, 1])}" for k in named]
        self._draw_labels(streams, "names", places, texts, [lines[k].colour for k in named])

    def _draw_axes(self, streams: RerunStreams, xs: Sequence[float], ys: Sequence[float]) -> None:
        """Draw a line at every number of the value axis, and the numbers of both axes."""
        import rerun as rr

        grid = [self._scaled(np.array([(xs[0], y), (xs[-1], y)]), xs, ys) for y in ys]
        colours = [palette.DIM if y == 0.0 else palette.FAINT for y in ys]
        radii = rr.Radius.ui_points(0.5)
        streams.log(f"{self.path}/grid", rr.LineStrips2D(grid, colors=colours, radii=radii))
        along = self._scaled(np.array([(x, ys[0]) for x in xs]), xs, ys)
        across = self._scaled(np.array([(xs[0], y) for y in ys]), xs, ys)
        places = [(x, y + 0.02) for x, y in along]
        places += [(x - 0.5 * _LEFT, y - self._raise) for x, y in across]
        places.append((self._width + 0.5 * _RIGHT, 0.5 * _BOTTOM))
        texts = [format_number(number) for number in (*xs, *ys)] + ["generation"]
        self._draw_labels(streams, "numbers", places, texts)

    def _draw_labels(
        self,
        streams: RerunStreams,
        name: str,
        places: Sequence[tuple[float, float]],
        texts: Sequence[str],
        colours: Sequence[palette.Colour] = (palette.SOFT,),
    ) -> None:
        import rerun as rr

        labels = rr.Points2D(
            np.array(places).reshape(-1, 2),
            labels=list(texts),
            radii=0.0,
            colors=list(colours),
            show_labels=True,
        )
        streams.log(f"{self.path}/{name}", labels)

    def _scaled(self, points: FloatArray, xs: Sequence[float], ys: Sequence[float]) -> FloatArray:
        """Return points, (n, 2), in units of the view, whose y axis points down."""
        low, size = np.array([xs[0], ys[0]]), np.array([xs[-1] - xs[0], ys[-1] - ys[0]])
        return np.asarray((points - low) / size * (self._width, -_HEIGHT))


def _plausible(line: Line) -> Line:
    """Return a line without the points that cannot be drawn: any peer may publish any number."""
    is_drawn = np.abs(line.points[:, 1]) < _MAX_VALUE  # false for NaN
    return replace(line, points=line.points[is_drawn])


def ticks(low: float, high: float, is_whole: bool = False) -> list[float]:
    """Return evenly spaced round numbers, the first at most `low` and the last at least `high`.

    If they must be whole (generations), they begin and end at `low` and `high` themselves.
    """
    if is_whole:
        step = max(1.0, _round_step((high - low) / _TICKS))
        inner = np.arange(math.floor(low / step) + 1, math.ceil(high / step)) * step
        room = 0.6 * step
        inside = [x for x in inner.tolist() if low + room < x < high - 1.5 * room]
        return [low, *inside, max(high, low + 1.0)]
    step = _round_step(max(high - low, 1e-6 * abs(low), 1e-9) / _TICKS)
    first = math.floor(low / step + 1e-6)
    last = max(math.ceil(high / step - 1e-6), first + 1)
    return [k * step for k in range(first, last + 1)]


def _round_step(step: float) -> float:
    """Return the next larger one of 1, 2 and 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(max(step, 1e-12)))
    return next(k * power for k in (1.0, 2.0, 5.0, 10.0) if k * power >= step * (1.0 - 1e-9))


def spread_out(heights: Sequence[float], gap: float) -> list[float]:
    """Return heights in the same order with at least a gap between any two, moved upwards where they are too close."""
    moved = list(heights)
    lowest = float("inf")
    for k in sorted(range(len(moved)), key=lambda k: -moved[k]):
        moved[k] = min(moved[k], lowest - gap)
        lowest = moved[k]
    return moved


def format_number(value: float) -> str:
    """Return a number with as many digits as a person reads."""
    if abs(value) >= 1e6:
        return f"{value:.3g}"
    if abs(value) >= 100.0 or value == round(value):
        return f"{value:,.0f}"
    if abs(value) >= 10.0:
        return f"{value:.1f}"
    return f"{round(value, 2) + 0.0:.2f}".rstrip("0").rstrip(".")
