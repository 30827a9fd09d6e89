"""The figures by generation: a line for a run, or for the mean of a condition's runs, in its band."""

from collections.abc import Sequence
from math import ceil
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from crcolony.results.generation_summary import quantile_name
from crcolony.results.plots.bands import MIN_RUNS
from crcolony.results.plots.conditions import Condition, PlotError
from crcolony.results.plots.potentials import draw_potentials
from crcolony.results.plots.style import (
    COLUMN_IN,
    LINES,
    PAGE_IN,
    band_look,
    format_axes,
    new_figure,
)
from crcolony.robot.genes import META_PARAMETERS
from crcolony.robot.modules import MODULES

_PANELS = {
    "matings": "Matings per agent",
    "conceptions": "Conceptions per agent",
    "captures": "Batteries captured per agent",
    "energy": "Mean energy while alive",
    "starved": "Share of agents that starved",
    "lived_steps": "Steps lived per agent",
}
_SHARES = ("energy", "starved")
_SYMBOLS = dict(zip(META_PARAMETERS, ("α", "γ", "λ", "τ", "decay of τ"), strict=True))
_CHARACTERS_PER_IN = 14.5
"""Of a legend's text, on average."""
_HANDLE_CHARACTERS = 8
"""The width of the piece of a line beside a legend's text, in characters."""
_LINE_IN = 0.16
"""The height of a line of a legend."""


def draw_figures(conditions: Sequence[Condition]) -> dict[str, Figure]:
    """Return the figures of some conditions by name; for several runs also `matings` alone, for a column of a paper.

    Raises PlotError for more conditions than can be told apart, or a history that cannot be read.
    """
    if len(conditions) > len(LINES):
        raise PlotError(f"{len(conditions)} settings: a figure can show {len(LINES)}")
    figures = {} if _is_single(conditions) else {"matings": draw_matings(conditions)}
    return figures | {
        "generations": draw_generations(conditions),
        "meta_parameters": draw_meta_parameters(conditions),
        "potentials": draw_potentials(conditions),
    }


def draw_matings(conditions: Sequence[Condition]) -> Figure:
    """Draw the matings by generation, one column wide."""
    figure = new_figure(COLUMN_IN, 1.9)
    axes = figure.subplots()
    _draw_lines(axes, conditions, "matings")
    format_axes(axes)
    axes.set_xlabel("generation")
    axes.set_ylabel("matings per agent")
    _add_legend(figure, conditions, caption(conditions))
    return figure


def draw_generations(conditions: Sequence[Condition]) -> Figure:
    """Draw the means of what agents did, and of their energy, by generation."""
    figure = new_figure(PAGE_IN, 3.2)
    rows = figure.subplots(2, 3, sharex=True)
    for axes, (column, title) in zip(rows.flat, _PANELS.items(), strict=True):
        _draw_lines(axes, conditions, column)
        format_axes(axes, title, top=1.0 if column in _SHARES else 0.0)
    for axes in rows[-1]:
        axes.set_xlabel("generation")
    _add_legend(figure, conditions, caption(conditions))
    return figure


def draw_meta_parameters(conditions: Sequence[Condition]) -> Figure:
    """Draw each module's meta-parameters: for one run the median and the spread over agents, for more the medians.

    The axes show the whole range that evolution may use.
    """
    figure = new_figure(PAGE_IN, 2.9)
    rows = figure.subplots(len(MODULES), len(META_PARAMETERS), sharex=True, sharey="col")
    for module, axes_row in zip(MODULES, rows, strict=True):
        for meta, axes in zip(META_PARAMETERS, axes_row, strict=True):
            gene = f"{module.name}.{meta}"
            if _is_single(conditions):
                _draw_spread(axes, conditions[0], gene)
            _draw_lines(axes, conditions, quantile_name(gene, 0.5))
            format_axes(axes, top=_highest(conditions, meta))
        axes_row[0].set_ylabel(module.name)
    for meta, top, bottom in zip(META_PARAMETERS, rows[0], rows[-1], strict=True):
        top.set_title(_SYMBOLS[meta])
        bottom.set_xlabel("generation")
    if _is_single(conditions):
        words = "Medians over agents, and the middle 50 % and 90 % of them"
    else:
        words = f"Each run's median over agents. {caption(conditions)}".strip()
    _add_legend(figure, conditions, words)
    return figure


def caption(conditions: Sequence[Condition]) -> str:
    """Return a caption that explains lines and bands; empty if no condition has several runs."""
    sizes = {len(condition.runs) for condition in conditions}
    if max(sizes) == 1:
        return ""
    if max(sizes) < MIN_RUNS:
        return "Means over runs; bands go from one run to the other"
    if 2 in sizes:
        return (
            "Means over runs with 95 % intervals (Student's t);\n"
            "of two runs the bands go from one to the other"
        )
    return "Means over runs with 95 % intervals (Student's t)"


def _is_single(conditions: Sequence[Condition]) -> bool:
    """Return whether there is only one run."""
    return sum(len(condition.runs) for condition in conditions) == 1


def _draw_lines(axes: Axes, conditions: Sequence[Condition], column: str) -> None:
    for condition, line in zip(conditions, LINES, strict=False):
        band = condition.band(column)
        if len(condition.runs) > 1:
            axes.fill_between(band.generation, band.low, band.high, **band_look(line))
        dot = "o" if band.generation.size == 1 else ""  # a line of one point is invisible
        axes.plot(band.generation, band.mean, marker=dot, **line)


def _draw_spread(axes: Axes, condition: Condition, gene: str) -> None:
    table = condition.runs[0].table
    for low, high in ((0.05, 0.95), (0.25, 0.75)):
        axes.fill_between(
            table["generation"],
            table[quantile_name(gene, low)],
            table[quantile_name(gene, high)],
            **(band_look(LINES[0]) | {"linewidth": 0.0}),
        )


def _highest(conditions: Sequence[Condition], meta: str) -> float:
    """Return the upper limit of a meta-parameter over all conditions."""
    return max(
        float(getattr(condition.config.heredity, f"highest_{meta}")) for condition in conditions
    )


def _add_legend(figure: Figure, conditions: Sequence[Condition], title: str) -> None:
    """Add a legend on top and make room for it: each condition's line in its band, side by side if they fit."""
    labels = [condition.label for condition in conditions]
    bands = [Patch(**band_look(line)) for line in LINES]
    lines = [Line2D([], [], **line) for line in LINES]
    handles: list[Any] = [  # matplotlib's types know no legend of a line in its band
        (band, line) if len(condition.runs) > 1 else (line,)
        for condition, band, line in zip(conditions, bands, lines, strict=False)
    ]
    characters = int(figure.get_figwidth() * _CHARACTERS_PER_IN)
    columns = max(1, characters // (max(map(len, labels)) + _HANDLE_CHARACTERS))
    figure.legend(
        handles,
        labels,
        loc="outside upper left",
        ncols=min(columns, len(conditions)),
        title=title,
        alignment="left",
    )
    height = ceil(len(conditions) / columns) + len(title.splitlines())
    figure.set_figheight(figure.get_figheight() + _LINE_IN * height)
