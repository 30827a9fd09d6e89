"""The files of figures can be used in a paper as they are."""

from pathlib import Path

import pytest
from matplotlib.figure import Figure

from crcolony.results.plots import draw_plots
from crcolony.results.plots.conditions import PlotError, read_conditions
from crcolony.results.plots.figures import (
    draw_matings,
)
from crcolony.results.plots.potentials import draw_potentials
from crcolony.results.plots.style import style, write_figure


def test_the_same_runs_give_the_same_bytes(comparison: Path, tmp_path: Path) -> None:
    """In every format, with lines and with images; no file contains a date."""
    with style():
        for draw in (draw_matings, draw_potentials):
            for kind in ("pdf", "svg", "png"):
                one, other = (
                    write_figure(draw(read_conditions([comparison])), tmp_path / f"{name}.{kind}")
                    for name in ("one", "other")
                )
                assert one.read_bytes() == other.read_bytes()
                assert b"Date" not in one.read_bytes()
                assert b"dc:date" not in one.read_bytes()


def test_fonts_are_embedded_as_truetype(figures: dict[str, Figure], tmp_path: Path) -> None:
    """As publishers ask: none is a bitmap, or drawn by PostScript."""
    with style():
        content = write_figure(figures["meta_parameters"], tmp_path / "figure.pdf").read_bytes()
    assert b"/FontFile2" in content
    assert b"/Type3" not in content


def test_a_file_that_cannot_be_written_is_named(copy: Path) -> None:
    """A file is in the way; nothing is left half-written."""
    folder = copy / "implicit" / "seed-1"
    (folder / "plots").touch()
    with pytest.raises(PlotError, match=r"plots/generations\.png: cannot be written"):
        draw_plots(folder)
