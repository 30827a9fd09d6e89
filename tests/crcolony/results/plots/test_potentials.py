"""Potentials are drawn from the genes in the history."""

import sqlite3
from pathlib import Path

import numpy as np
import pytest

from crcolony.results.plots import draw_plots
from crcolony.results.plots.conditions import PlotError
from crcolony.results.plots.potentials import draw_potentials
from tests.support.plotted_runs import drawn, picture, run_to_end
from tests.support.small_colony import small


def test_drawing_leaves_the_history_alone(copy: Path) -> None:
    """It is only read."""
    folder = copy / "implicit" / "seed-1"
    before = (folder / "history.sqlite").read_bytes()
    drawn([folder], draw_potentials)
    assert (folder / "history.sqlite").read_bytes() == before
    database = sqlite3.connect(folder / "history.sqlite")
    assert database.execute("PRAGMA integrity_check").fetchone()


def test_potentials_are_the_mean_over_agents_and_runs(tmp_path: Path) -> None:
    """With one agent a run, the image of three runs is the mean of their three images."""
    settings = ("life.agents=1", "robots=1")
    folders = [
        run_to_end(tmp_path / str(seed), small(*settings, f"seed={seed}")) for seed in (1, 2, 3)
    ]
    alone = [picture(drawn([folder], draw_potentials)) for folder in folders]
    assert np.allclose(picture(drawn(folders, draw_potentials)), np.mean(alone, axis=0))


def test_conditions_without_shaping_have_no_potentials_to_show(
    comparison: Path, tmp_path: Path
) -> None:
    """They would be flat."""
    flat = run_to_end(tmp_path / "flat", small("learning.shaping=false"))
    figure = drawn([comparison / "implicit" / "seed-1", flat], draw_potentials)
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert [title for title in titles if title] == ["learning.shaping = true (1 run, seed 1)"]


def test_a_potential_may_be_flat_beside_another(comparison: Path, tmp_path: Path) -> None:
    """It has the same colours, and no contour line."""
    settings = ("heredity.potential_sd=1e-6", "heredity.potential_mutation_sd=0.0")
    flat = run_to_end(tmp_path / "flat", small(*settings))
    figure = drawn([comparison / "implicit" / "seed-1", flat], draw_potentials)
    shaped, _, below, *_ = figure.axes
    assert shaped.images[0].get_clim() == below.images[0].get_clim()
    assert (len(shaped.collections), len(below.collections)) == (1, 0)


def test_damaged_configs_and_histories_are_refused(copy: Path) -> None:
    """No database, agents without genes, and an unknown setting."""
    folder = copy / "implicit" / "seed-1"
    history = folder / "history.sqlite"
    with sqlite3.connect(history) as database:
        database.execute("UPDATE births SET genes = x'00'")
    with pytest.raises(PlotError, match=rf"{history}: "):
        draw_plots(folder)
    history.write_bytes(b"nothing" * 1000)
    with pytest.raises(PlotError, match=rf"{history}: .*not a database"):
        draw_plots(folder)
    history.unlink()
    with pytest.raises(PlotError, match=rf"{history}: "):
        draw_plots(folder)
    (folder / "config.toml").write_text("robotts = 3")
    with pytest.raises(PlotError, match=r"config\.toml: robotts: there is no such setting"):
        draw_plots(folder)
