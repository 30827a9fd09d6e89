"""A curve of many runs has their median and middle half at every point."""

import numpy as np

from crcolony.experiments.framework.experiment import Row
from crcolony.experiments.framework.quartile_curve import draw_quartiles, quartiles_of
from crcolony.results.plots.style import LINES, new_figure

ROWS: list[Row] = [
    {"condition": "own", "seed": seed, "steps": steps, "value": float(10 * steps + seed)}
    for seed in range(5)
    for steps in (2, 1)
] + [
    {"condition": "other", "seed": 1, "steps": 1, "value": 99.0},
    {"condition": "own", "seed": 1, "value": 99.0},
    {"condition": "own", "seed": 1, "steps": 1},
]


def test_quartiles_are_those_of_the_condition_in_the_order_of_points() -> None:
    """Rows without a point or a value are not counted; no rows are no points."""
    points, quartiles = quartiles_of(ROWS, "own", "steps", "value")
    assert points.tolist() == [1.0, 2.0]
    assert quartiles.tolist() == [[11.0, 21.0], [12.0, 22.0], [13.0, 23.0]]
    points, quartiles = quartiles_of(ROWS, "nobody", "steps", "value")
    assert points.size == 0
    assert quartiles.shape == (3, 0)


def test_the_median_is_a_line_and_the_middle_half_a_band() -> None:
    """With its name for the legend."""
    axes = new_figure(3.0, 2.0).subplots()
    draw_quartiles(axes, *quartiles_of(ROWS, "own", "steps", "value"), "own", LINES[0])
    (line,) = axes.lines
    assert line.get_label() == "own"
    assert np.array_equal(line.get_ydata(), [12.0, 22.0])
    assert len(axes.collections) == 1
