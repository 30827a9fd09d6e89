"""Figures by generation show what is in the tables, for one run or for many."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.image import imread

from crcolony.results.generation_table import read_table, write_table
from crcolony.results.plots import draw_plots
from crcolony.results.plots.conditions import PlotError, read_conditions
from crcolony.results.plots.figures import (
    draw_figures,
    draw_matings,
    draw_meta_parameters,
)
from crcolony.results.plots.style import COLUMN_IN, LINES, PAGE_IN
from crcolony.robot.genes import META_PARAMETERS
from tests.support.plotted_runs import bands_in, drawn, heights, legend_of, run_to_end
from tests.support.small_colony import small

T_OF_3 = 4.30265
"""Student's t for 95 %, two-sided, of 3 values, from a printed table."""


def test_every_figure_is_a_picture_that_is_not_empty(tmp_path: Path) -> None:
    """Generations, meta-parameters, potentials."""
    paths = draw_plots(run_to_end(tmp_path / "run", small()))
    assert [path.name for path in paths] == [
        "generations.png",
        "meta_parameters.png",
        "potentials.png",
    ]
    for path in paths:
        pixels = imread(path)
        assert min(pixels.shape[:2]) > 300
        assert len(np.unique(pixels[..., 0])) > 50


@pytest.mark.parametrize(
    "settings",
    [
        ("learning.shaping=false",),
        ("life.agents=1", "robots=1"),
        ("generations=1",),
        ("heredity.highest_lambda=0",),
    ],
)
def test_small_and_unshaped_colonies_have_figures_too(
    tmp_path: Path, settings: tuple[str, ...]
) -> None:
    """With flat potentials, a single agent or generation to show, or a meta-parameter that is always 0."""
    assert len(draw_plots(run_to_end(tmp_path / "run", small(*settings)))) == 3


def test_one_run_has_lines_without_bands_and_the_spread_over_its_agents(comparison: Path) -> None:
    """Matings are as in the table; of a meta-parameter half and nine tenths of the agents are shown."""
    folder = comparison / "implicit" / "seed-2"
    generations, meta = drawn([folder]), drawn([folder], draw_meta_parameters)
    rows = read_table(folder / "generations.csv")
    assert heights(generations.axes[0]) == [float(row["matings"]) for row in rows]
    assert not bands_in(generations.axes[0])
    # the τ at the end of a life is no gene: there is no neutral one beside it
    assert [len(bands_in(axes)) for axes in meta.axes] == 2 * [3, 3, 3, 3, 3, 2]
    assert legend_of(generations) == ["", "1 run, seed 2"]
    assert "the middle 50 % and 90 %" in legend_of(meta)[0]
    assert legend_of(meta)[0].endswith("\nGrey: where 90 % of neutral genes would lie")


def test_a_comparison_has_all_conditions_in_every_axes(figures: dict[str, Figure]) -> None:
    """Each figure by generation has a line and a band for both, and a legend; axes have titles."""
    assert list(figures) == ["matings", "runs", "generations", "meta_parameters", "potentials"]
    for name in ("matings", "generations", "meta_parameters"):
        figure = figures[name]
        for k, axes in enumerate(figure.axes):
            neutral = name == "meta_parameters" and k % 6 < 5
            assert (len(axes.lines), len(bands_in(axes))) == (2, 2 + neutral)
        title, *labels = legend_of(figure)
        assert "Means over runs with 95 % intervals (Student's t)" in title
        assert labels == ["implicit (3 runs)", "central (3 runs)"]
    titles = [axes.get_title(loc="left") for axes in figures["generations"].axes]
    assert titles == [
        "Matings per agent",
        "… weighted by energy",
        "Conceptions per agent",
        "Share of mating steps",
        "Batteries captured per agent",
        "Mean energy while alive",
        "Share of agents that starved",
        "Steps lived per agent",
    ]
    meta = figures["meta_parameters"].axes
    assert [axes.get_title(loc="left") for axes in meta[:6]] == [
        "α",
        "γ",
        "λ",
        "τ",
        "decay of τ",
        "last τ of a life",
    ]
    assert [meta[0].get_ylabel(), meta[6].get_ylabel()] == ["foraging", "mating"]


def test_what_a_history_does_not_hold_is_left_out(copy: Path) -> None:
    """The table of robots in their own processes has no share of mating steps, and no τ at the end of a life."""
    folder = copy / "implicit" / "seed-1"
    table = folder / "generations.csv"
    rows = [
        {name: row[name] for name in row if name != "mating_share" and "effective" not in name}
        for row in read_table(table)
    ]
    write_table(table, rows)
    generations, meta = drawn([folder]), drawn([folder], draw_meta_parameters)
    assert len(generations.axes) == 7
    assert len(meta.axes) == 10


def test_what_is_drawn_is_the_mean_and_the_interval_of_the_tables(
    comparison: Path, figures: dict[str, Figure]
) -> None:
    """For the matings, and for the medians of every meta-parameter of a module."""
    shown = {"matings": figures["matings"].axes[0]}
    for meta, axes in zip(META_PARAMETERS, figures["meta_parameters"].axes, strict=False):
        shown[f"foraging.{meta} q50"] = axes
    for column, axes in shown.items():
        values = np.array(
            [
                [float(row[column]) for row in read_table(folder / "generations.csv")]
                for folder in sorted((comparison / "implicit").iterdir())
            ]
        )
        mean = values.mean(axis=0)
        high = mean + T_OF_3 * values.std(axis=0, ddof=1) / np.sqrt(3.0)
        assert heights(axes) == pytest.approx(mean)
        corners = np.asarray(bands_in(axes)[-2].get_paths()[0].vertices)
        assert max(corners[:, 1]) == pytest.approx(high.max(), rel=1e-5)


@pytest.mark.parametrize(
    ("sizes", "text"),
    [
        ((1, 1), ""),
        ((2, 1), "Means over runs; bands go from one run to the other"),
        ((2, 3), "of two runs the bands go from one to the other"),
        ((3, 1), "Means over runs with 95 % intervals (Student's t)"),
    ],
)
def test_the_legend_explains_the_bands(comparison: Path, sizes: Sequence[int], text: str) -> None:
    """It also has the number of runs; a single run has no band."""
    folders = [
        comparison / condition / f"seed-{seed}"
        for condition, size in zip(("implicit", "central"), sizes, strict=True)
        for seed in range(1, size + 1)
    ]
    figure = drawn(folders, draw_matings)
    assert len(bands_in(figure.axes[0])) == sum(size > 1 for size in sizes)
    title, *labels = legend_of(figure)
    assert text in title
    counts = [f"({size} runs)" if size > 1 else "(1 run, seed 1)" for size in sizes]
    assert [label.partition(" (")[2] for label in labels] == [c[1:] for c in counts]


def test_more_conditions_than_a_figure_can_show_are_refused(comparison: Path) -> None:
    """Seven."""
    (condition, *_) = read_conditions([comparison])
    with pytest.raises(PlotError, match="7 settings: a figure can show 6"):
        draw_figures(7 * [condition])


def test_figures_are_as_wide_as_a_column_or_two(figures: dict[str, Figure]) -> None:
    """Lines differ in colour and in dashes."""
    assert {name: figure.get_figwidth() for name, figure in figures.items()} == {
        "matings": COLUMN_IN,
        "runs": PAGE_IN,
        "generations": PAGE_IN,
        "meta_parameters": PAGE_IN,
        "potentials": COLUMN_IN,
    }
    assert len({to_hex(line["color"]) for line in LINES}) == len(LINES)
    assert len({str(line["linestyle"]) for line in LINES}) == len(LINES)
