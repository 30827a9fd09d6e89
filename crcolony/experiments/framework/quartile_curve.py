"""Curves of many runs: the median over runs at every point, and the middle half as a band."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.experiments.framework.experiment import CONDITION, Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def quartiles_of(
    rows: Sequence[Row], condition: str, along: str, column: str
) -> tuple[FloatArray, FloatArray]:
    """Return the points of a condition, (points,) values of the column `along`, and a column's quartiles, (3, points).

    These are over the runs at each point; rows without one of the two columns are left out.
    """
    at: dict[float, list[float]] = {}
    for row in rows:
        if row[CONDITION] == condition and along in row and column in row:
            at.setdefault(float(row[along]), []).append(float(row[column]))
    points = sorted(at)
    quartiles = np.array([np.quantile(at[point], (0.25, 0.5, 0.75)) for point in points])
    return np.array(points), quartiles.reshape(-1, 3).T


def draw_quartiles(
    axes: "Axes", points: FloatArray, quartiles: FloatArray, label: str, line: Mapping[str, Any]
) -> None:
    """Draw the median (points,) as a line of a style, and the middle half around it."""
    low, middle, high = quartiles
    axes.plot(points, middle, label=label, **line)
    axes.fill_between(points, low, high, color=line["color"], alpha=0.2)
