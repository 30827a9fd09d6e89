"""Plots are drawn from a results folder alone, and what cannot be drawn is said in a line."""

import sqlite3
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from crcolony.colony.evolve import begin, evolve
from crcolony.colony.plots import PlotsError, draw_plots
from crcolony.config import Config
from tests.colony.small import small


def run(folder: Path, config: Config) -> Path:
    results, colony = begin(folder, config)
    evolve(results, colony, lambda: False, lambda _: None)
    results.close()
    return folder


def test_every_plot_is_a_picture_with_something_on_it(tmp_path: Path) -> None:
    """Generations, meta-parameters, potentials."""
    paths = draw_plots(run(tmp_path / "run", small()))
    assert [path.stem for path in paths] == ["generations", "meta_parameters", "potentials"]
    for path in paths:
        picture = imread(path)
        assert min(picture.shape[:2]) > 300
        assert len(np.unique(picture[..., 0])) > 50


@pytest.mark.parametrize("settings", [("learning.shaping=false",), ("life.agents=1", "robots=1")])
def test_small_and_unshaped_colonies_have_plots_too(
    tmp_path: Path, settings: tuple[str, ...]
) -> None:
    """With flat potentials, or a single agent to show."""
    assert len(draw_plots(run(tmp_path / "run", small(*settings)))) == 3


def test_what_cannot_be_drawn_is_said_by_name(tmp_path: Path) -> None:
    """No folder, no generation yet, a table or a database that is damaged."""
    with pytest.raises(PlotsError, match="nowhere"):
        draw_plots(tmp_path / "nowhere")
    folder = run(tmp_path / "run", small())
    (folder / "history.sqlite").write_bytes(b"nothing" * 1000)
    with pytest.raises(PlotsError, match="not a database"):
        draw_plots(folder)
    (folder / "generations.csv").write_text("generation,matings\n0,many\n")
    with pytest.raises(PlotsError, match=r"generations\.csv: corrupt"):
        draw_plots(folder)
    (folder / "generations.csv").write_text("generation\n0\n")
    with pytest.raises(PlotsError, match=r"generations\.csv: corrupt"):
        draw_plots(folder)
    (folder / "generations.csv").write_text("")
    with pytest.raises(PlotsError, match="no generation has ended"):
        draw_plots(folder)


def test_drawing_leaves_the_history_alone(tmp_path: Path) -> None:
    """It only reads."""
    folder = run(tmp_path / "run", small())
    before = (folder / "history.sqlite").read_bytes()
    draw_plots(folder)
    assert (folder / "history.sqlite").read_bytes() == before
    assert sqlite3.connect(folder / "history.sqlite").execute("PRAGMA integrity_check").fetchone()
