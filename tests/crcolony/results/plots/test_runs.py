"""Every run is a point, at the mean of its last generations."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from crcolony.results.generation_table import read_table, write_table
from crcolony.results.plots.runs import draw_runs
from tests.support.plotted_runs import drawn

T_OF_3 = 4.30265
"""Student's t for 95 %, two-sided, of 3 values, from a printed table."""


def ends_of(folder: Path, column: str) -> list[float]:
    """Return the means of the runs of a condition."""
    return [
        float(np.mean([float(row[column]) for row in read_table(run / "generations.csv")]))
        for run in sorted(folder.iterdir())
    ]


def interval_in(axes: Axes, place: int) -> tuple[float, float]:
    """Return the ends of the error bar of a condition."""
    (bar,) = [
        part for part in axes.containers[place].get_children() if isinstance(part, LineCollection)
    ]
    low, high = np.asarray(bar.get_segments()[0])[:, 1].tolist()
    return low, high


def test_points_are_the_ends_of_the_runs(comparison: Path) -> None:
    """One for each run and condition, at places of their own, and beside them the mean with its interval."""
    figure = drawn([comparison], draw_runs)
    columns = ("matings", "energy_weighted_matings", "mating_share", "starved")
    for axes, column in zip(figure.axes, columns, strict=True):
        for place, name in enumerate(("implicit", "central")):
            points, mean = axes.lines[2 * place : 2 * place + 2]
            ends = ends_of(comparison / name, column)
            assert np.asarray(points.get_ydata()) == pytest.approx(ends)
            assert len(set(np.asarray(points.get_xdata()).tolist())) == 3
            assert np.asarray(mean.get_ydata()) == pytest.approx([np.mean(ends)])
            low, high = interval_in(axes, place)
            half = T_OF_3 * np.std(ends, ddof=1) / np.sqrt(3.0)
            assert (low, high) == pytest.approx(
                (np.mean(ends) - half, np.mean(ends) + half), rel=1e-5
            )
        names = [label.get_text() for label in axes.get_xticklabels()]
        assert names == ["implicit", "central"]


def test_two_runs_have_no_interval_and_unknown_columns_no_axes(copy: Path) -> None:
    """As in tables of robots in their own processes."""
    folders = [copy / "implicit" / f"seed-{k}" for k in (1, 2)]
    table = folders[0] / "generations.csv"
    rows = [{k: v for k, v in row.items() if k != "mating_share"} for row in read_table(table)]
    write_table(table, rows)
    figure = drawn(folders, draw_runs)
    assert [axes.get_title(loc="left") for axes in figure.axes] == [
        "Matings per agent",
        "… weighted by energy",
        "Share that starved",
    ]
    low, high = interval_in(figure.axes[0], 0)
    assert low == high
