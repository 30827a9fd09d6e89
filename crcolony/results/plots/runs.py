"""Every run as a point at its end, beside the mean of its condition: a mean over two modes hides both."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from crcolony.results.generation_table import LAST_GENERATIONS
from crcolony.results.plots.bands import MIN_RUNS, half_interval
from crcolony.results.plots.conditions import Condition
from crcolony.results.plots.style import LINES, PAGE_IN, format_axes, new_figure

_PANELS = {
    "matings": "Matings per agent",
    "energy_weighted_matings": "… weighted by energy",
    "mating_share": "Share of mating steps",
    "starved": "Share that starved",
}
_SHARES = ("mating_share", "starved")
_SPREAD = 0.2
"""Half the width over which the points of a condition are spread, in the order of its runs."""
_MEAN_AT = 0.36
"""The mean stands so far to the right of its points."""


def draw_runs(conditions: Sequence[Condition]) -> Figure:
    """Draw the mean of every run's last generations, and the mean over runs with its 95 % interval (Student's t)."""
    panels = {
        column: title
        for column, title in _PANELS.items()
        if all(column in run.table for condition in conditions for run in condition.runs)
    }
    figure = new_figure(PAGE_IN, 2.2)
    row = figure.subplots(1, len(panels), squeeze=False)[0]
    for axes, (column, title) in zip(row, panels.items(), strict=True):
        for place, condition in enumerate(conditions):
            _draw_condition(axes, place, condition, column)
        format_axes(axes, title, top=1.0 if column in _SHARES else 0.0)
        names = [condition.name.replace(" ", "\n") for condition in conditions]
        axes.set_xticks(range(len(conditions)), names, fontsize=6)
        axes.set_xlim(-0.5, len(conditions) - 0.5)
    words = f"Every run as a point: the mean of its last {LAST_GENERATIONS} generations. "
    figure.suptitle(
        words + "Beside them the mean over runs, with its 95 % interval", x=0.01, ha="left"
    )
    return figure


def _draw_condition(axes: Axes, place: int, condition: Condition, column: str) -> None:
    values = np.array([run.table[column][-LAST_GENERATIONS:].mean() for run in condition.runs])
    spread = np.linspace(-_SPREAD, _SPREAD, values.size) if values.size > 1 else np.zeros(1)
    colour = LINES[place]["color"]
    axes.plot(place + spread, values, "o", color=colour, alpha=0.6, markeredgewidth=0.0)
    count = np.array([values.size])
    half = half_interval(values[:, None], count)[0] if values.size >= MIN_RUNS else 0.0
    axes.errorbar(
        place + _MEAN_AT,
        values.mean(),
        half,
        color=colour,
        marker="_",
        markersize=6.0,
        linewidth=1.0,
    )
