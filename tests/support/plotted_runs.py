"""Runs to be drawn, and what can be seen on the figures that are drawn of them."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import FillBetweenPolyCollection
from matplotlib.figure import Figure

from crcolony.config import Config
from crcolony.in_process.run import run_until_done, start_run
from crcolony.results.plots.conditions import Condition, read_conditions
from crcolony.results.plots.figures import draw_generations
from crcolony.results.plots.style import style
from tests.support.small_colony import small


def run_to_end(folder: Path, config: Config) -> Path:
    """Run an in-process colony into a folder until its end; return the folder."""
    results, colony = start_run(folder, config)
    run_until_done(results, colony, lambda: False, lambda _: None)
    results.close()
    return folder


def run_comparison(out: Path) -> Path:
    """Run three seeds of two conditions into folders as of `evolve --seeds 3 --compare`; return the folder."""
    for seed in (1, 2, 3):
        run_to_end(out / "implicit" / f"seed-{seed}", small(f"seed={seed}"))
        run_to_end(out / "central" / f"seed-{seed}", small(f"seed={seed}", "selection=central"))
    return out


def cut(folder: Path, generations: int) -> None:
    """Cut the table of a run after so many generations."""
    path = folder / "generations.csv"
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[: generations + 1]))


def drawn(
    folders: Sequence[Path], draw: Callable[[Sequence[Condition]], Figure] = draw_generations
) -> Figure:
    """Return the figure of the runs of some folders."""
    with style():
        return draw(read_conditions(folders))


def heights(axes: Axes) -> list[float]:
    """Return the values of the first line."""
    return [float(y) for y in np.asarray(axes.lines[0].get_ydata())]


def picture(figure: Figure) -> np.ndarray:
    """Return the values of the first image."""
    return np.asarray(figure.axes[0].images[0].get_array())


def bands_in(axes: Axes) -> list[FillBetweenPolyCollection]:
    """Return the bands that are drawn in axes."""
    return [part for part in axes.collections if isinstance(part, FillBetweenPolyCollection)]


def legend_of(figure: Figure) -> list[str]:
    """Return the texts of the legend, its title first."""
    (legend,) = figure.legends
    return [legend.get_title().get_text(), *(text.get_text() for text in legend.get_texts())]
