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
from crcolony.results.plots.neutral_band import neutral_bands
from crcolony.results.plots.potentials import draw_potentials
from crcolony.results.plots.runs import draw_runs
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
    "energy_weighted_matings": "… weighted by energy",
    "conceptions": "Conceptions per agent",
    "mating_share": "Share of mating steps",
    "captures": "Batteries captured per agent",
    "energy": "Mean energy while alive",
    "starved": "Share of agents that starved",
    "lived_steps": "Steps lived per agent",
}
_SHARES = ("energy", "starved", "mating_share")
_SYMBOLS = dict(zip(META_PARAMETERS, ("α", "γ", "λ", "τ", "decay of τ"), strict=True)) | {
    "effective_tau": "last τ of a life"
}
_RANGES = {"effective_tau": "tau"}
"""What has the range of a meta-parameter of another name."""
_NEUTRAL: dict[str, Any] = {"color": "0.88", "linewidth": 0.0, "zorder": 0}
"""The look of the band of a neutral gene."""
_CHARACTERS_PER_IN = 14.5
"""Of a legend's text, on average."""
_HANDLE_CHARACTERS = 8
"""The width of the piece of a line beside a legend's text, in characters."""
_LINE_IN = 0.16
"""The height of a line of a legend."""


def draw_figures(conditions: Sequence[Condition]) -> dict[str, Figure]:
    """Return the figures of some conditions by name; for several also every run, and `matings` alone, for a column.

    Raises PlotError for more conditions than can be told apart, or a history that cannot be read.
    """
    if len(conditions) > len(LINES):
        raise PlotError(f"{len(conditions)} settings: a figure can show {len(LINES)}")
    figures = (
        {}
        if _is_single(conditions)
        else {"matings": draw_matings(conditions), "runs": draw_runs(conditions)}
    )
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
    panels = {column: title for column, title in _PANELS.items() if _is_known(conditions, column)}
    figure = new_figure(PAGE_IN, 3.2)
    rows = figure.subplots(2, ceil(len(panels) / 2), sharex=True)
    for axes, (column, title) in zip(rows.flat, panels.items(), strict=False):
        _draw_lines(axes, conditions, column)
        format_axes(axes, title, top=1.0 if column in _SHARES else 0.0)
    for axes in rows.flat[len(panels) :]:
        axes.remove()
    for axes in rows[-1]:
        axes.set_xlabel("generation")
    _add_legend(figure, conditions, caption(conditions))
    return figure


def draw_meta_parameters(conditions: Sequence[Condition]) -> Figure:
    """Draw each module's meta-parameters: for one run the median and the spread over agents, for more the medians.

    Behind each is the band of a neutral gene, along the pedigrees of the first condition. The axes show the whole range
    that evolution may use.
    """
    metas = [
        meta
        for meta in _SYMBOLS
        if _is_known(conditions, quantile_name(f"{MODULES[0].name}.{meta}", 0.5))
    ]
    genes = [f"{module.name}.{meta}" for module in MODULES for meta in META_PARAMETERS]
    neutral = neutral_bands(conditions[0], genes)
    figure = new_figure(PAGE_IN, 2.9)
    rows = figure.subplots(len(MODULES), len(metas), sharex=True, sharey="col")
    for module, axes_row in zip(MODULES, rows, strict=True):
        for meta, axes in zip(metas, axes_row, strict=True):
            name = f"{module.name}.{meta}"
            if name in neutral:
                band = neutral[name]
                axes.fill_between(band.generation, band.low, band.high, **_NEUTRAL)
            if _is_single(conditions):
                _draw_spread(axes, conditions[0], name)
            _draw_lines(axes, conditions, quantile_name(name, 0.5))
            format_axes(axes, top=_highest(conditions, meta))
        axes_row[0].set_ylabel(module.name)
    for meta, top, bottom in zip(metas, rows[0], rows[-1], strict=True):
        top.set_title(_SYMBOLS[meta])
        bottom.set_xlabel("generation")
    _add_legend(figure, conditions, _explain_medians(conditions, bool(neutral)))
    return figure


def _explain_medians(conditions: Sequence[Condition], has_neutral: bool) -> str:
    if _is_single(conditions):
        words = "Medians over agents, and the middle 50 % and 90 % of them"
    else:
        words = f"Each run's median over agents. {caption(conditions)}".strip()
    if not has_neutral:
        return words
    of = f" ({conditions[0].name})" if len(conditions) > 1 and conditions[0].name else ""
    return f"{words}\nGrey: where 90 % of neutral genes would lie{of}"


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


def _is_known(conditions: Sequence[Condition], column: str) -> bool:
    """Return whether all runs have a column: some are unknown where a history was merged from robots' files."""
    return all(column in run.table for condition in conditions for run in condition.runs)


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
        float(getattr(condition.config.heredity, f"highest_{_RANGES.get(meta, meta)}"))
        for condition in conditions
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
