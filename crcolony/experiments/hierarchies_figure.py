"""The figure of evolved hierarchies: curves and the best graph of each environment, and the 2 x 2 of changes."""

from collections.abc import Sequence
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from crcolony.evolution.typed_tree import Tree, parse_tree
from crcolony.experiments.framework.experiment import CONDITION, Row, pairs_of
from crcolony.experiments.framework.quartile_curve import draw_quartiles, quartiles_of
from crcolony.experiments.framework.statistics import mean_interval
from crcolony.experiments.hierarchies_claims import (
    CHANGES,
    DARWINIAN,
    ENVIRONMENTS,
    INHERITANCES,
    LAMARCKIAN,
    SENSES,
    condition_of,
)

_FEWEST_ROWS = 14
"""A small hierarchy is not stretched over all of its axes"""

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def draw(rows: Sequence[Row]) -> "Figure":
    """Draw learning curves of the evolution above, the fittest hierarchy of all runs below, and the changes."""
    from crcolony.results.plots.style import PAGE_IN, new_figure

    figure = new_figure(PAGE_IN, 6.2)
    grid = figure.add_gridspec(3, 3, height_ratios=(1.0, 1.5, 1.0))
    for column, name in enumerate(ENVIRONMENTS):
        _draw_curves(figure.add_subplot(grid[0, column]), rows, name, column == 0)
        _draw_best(figure.add_subplot(grid[1, column]), rows, name)
    _draw_changes(figure.add_subplot(grid[2, :]), rows)
    return figure


def _draw_curves(axes: "Axes", rows: Sequence[Row], name: str, is_first: bool) -> None:
    from matplotlib.ticker import MaxNLocator

    from crcolony.results.plots.style import LINES

    for line, inheritance in zip(LINES, INHERITANCES, strict=False):
        curve = quartiles_of(rows, condition_of(name, inheritance), "generation", "mean_fitness")
        draw_quartiles(axes, *curve, inheritance, line)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set(title=name, xlabel="generation", ylim=(0.0, None))
    if is_first:
        axes.set_ylabel("packs brought home")
        axes.legend(loc="lower right")


def _draw_best(axes: "Axes", rows: Sequence[Row], name: str) -> None:
    """Draw the hierarchy of the fittest robot that evolved in an environment, whatever it inherited."""
    conditions = [condition_of(name, inheritance) for inheritance in INHERITANCES]
    ends = [row for row in rows if row[CONDITION] in conditions and "best_graph" in row]
    best = max(ends, key=lambda row: float(row["best_fitness"]))
    draw_tree(axes, parse_tree(str(best["best_graph"])))
    axes.set_title(f"the fittest: {float(best['best_fitness']):.0f} packs")


def draw_tree(axes: "Axes", tree: Tree) -> None:
    """Draw a hierarchy as folders are drawn: a row for each subtask, further right the deeper it is."""
    rows = {path: row for row, (path, _) in enumerate(tree.walk())}
    for path, node in tree.walk():
        depth, row = len(path), rows[path]
        if path:
            stem = depth - 0.85
            axes.plot(
                [stem, stem, depth - 0.1],
                [rows[path[:-1]] + 0.4, row, row],
                color="0.7",
                linewidth=0.6,
            )
        axes.text(
            depth,
            row,
            node.symbol,
            fontsize=6,
            va="center",
            fontweight="bold" if node.children else "normal",
        )
    axes.set(xlim=(-0.2, 6.0), ylim=(max(len(rows), _FEWEST_ROWS) - 0.4, -0.6))
    axes.set_axis_off()


def _draw_changes(axes: "Axes", rows: Sequence[Row]) -> None:
    from crcolony.results.plots.style import LINES

    cells = list(product(CHANGES, SENSES))
    for place, cell in enumerate(cells):
        lamarckian, darwinian = pairs_of(
            rows,
            "fitness_late",
            condition_of(*cell, LAMARCKIAN),
            condition_of(*cell, DARWINIAN),
        )
        ratios = lamarckian / np.maximum(darwinian, 1e-12)
        spread = np.linspace(-0.2, 0.2, ratios.size)
        axes.plot(place + spread, ratios, "o", color=LINES[1]["color"])
        mean = mean_interval(ratios)
        axes.errorbar(
            [place + 0.3],
            [mean.estimate],
            yerr=[[mean.estimate - mean.low], [mean.high - mean.estimate]],
            fmt="s",
            color="black",
            capsize=2.0,
        )
    axes.axhline(1.0, color="0.6", linewidth=0.6)
    axes.set_xticks(range(len(cells)), [", ".join(cell) for cell in cells])
    axes.set_ylabel("Lamarckian over Darwinian")
