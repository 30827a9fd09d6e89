"""The figures of one run or of many: quantities by generation, and the potentials that evolved.

conditions.py   the runs of some folders, grouped by their settings
bands.py        the mean over runs with its 95 % interval
figures.py      matings, energy, meta-parameters
neutral_band.py the drift of a neutral gene, behind the meta-parameters
runs.py         every run as a point
potentials.py   the shaping potentials
style.py        sizes, colours, fonts, files
"""

import logging
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

from crcolony.results.plots.conditions import Condition, PlotError, read_conditions

__all__ = [
    "Condition",
    "PlotError",
    "draw_conditions",
    "draw_generations_of",
    "draw_plots",
    "read_conditions",
]


def draw_plots(folder: Path) -> list[Path]:
    """Draw a run's figures into `folder/plots` as PNG files and return their paths; raises PlotError."""
    return draw_conditions(read_conditions([folder]), folder / "plots", ("png",))


def draw_generations_of(folder: Path) -> Path:
    """Draw what a run's agents did by generation, into `folder/plots`, and return the path; raises PlotError.

    It is the first of its figures, and takes a quarter of the time of all.
    """
    conditions = read_conditions([folder])
    _prepare()
    from crcolony.results.plots.figures import draw_generations
    from crcolony.results.plots.style import style, write_figure

    with style():
        return write_figure(draw_generations(conditions), folder / "plots" / "generations.png")


def draw_conditions(
    conditions: Sequence[Condition], out: Path, formats: Sequence[str]
) -> list[Path]:
    """Draw the figures of some conditions into a folder, each in every format (pdf, svg or png); return their paths.

    Equal runs give equal bytes. Raises PlotError if matplotlib is missing, or a file cannot be read or written.
    """
    _prepare()
    from crcolony.results.plots.figures import draw_figures
    from crcolony.results.plots.style import style, write_figure

    with style():
        return [
            write_figure(figure, out / f"{name}.{format_}")
            for name, figure in draw_figures(conditions).items()
            for format_ in formats
        ]


def _prepare() -> None:
    """Raise PlotError if a library is missing, and keep matplotlib quiet."""
    if any(find_spec(library) is None for library in ("matplotlib", "scipy")):
        raise PlotError("plots need matplotlib and scipy: pip install 'crcolony[experiments]'")
    # Without a home matplotlib keeps its cache in a temporary folder, and says so in several lines.
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
