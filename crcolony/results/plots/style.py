"""The look of figures on paper, and how they are written to files."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib
import matplotlib.style
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from crcolony.durable_files import replace_file
from crcolony.results.plots.conditions import PlotError

COLUMN_IN = 3.4
"""The width of a column of a paper."""
PAGE_IN = 7.0
"""The width of two columns."""

LINES: tuple[dict[str, Any], ...] = (
    {"color": "#0072b2", "linestyle": "-"},
    {"color": "#d55e00", "linestyle": (0, (4, 1.2))},
    {"color": "#009e73", "linestyle": (0, (1, 1))},
    {"color": "#cc79a7", "linestyle": (0, (5, 1.2, 1, 1.2))},
    {"color": "#000000", "linestyle": (0, (8, 2))},
    {"color": "#e69f00", "linestyle": (0, (3, 1, 1, 1, 1, 1))},
)
"""The colours of Okabe and Ito, for colour-blind readers too; the dashes are for print without colours."""

_ROOM = 1.04
"""Axes end so much above their highest line, so that it is not cut."""

_STYLE = {
    "font.size": 8,
    "axes.titlesize": 8,
    "axes.labelsize": 8,
    "figure.titlesize": 8,
    "legend.fontsize": 8,
    "legend.title_fontsize": 8,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.6,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "lines.linewidth": 1.2,
    "lines.markersize": 2.5,
    "contour.negative_linestyle": "solid",
    "legend.frameon": False,
    "legend.borderpad": 0.0,
    "legend.borderaxespad": 0.2,
    "legend.handlelength": 2.4,
    "pdf.fonttype": 42,  # TrueType, which publishers ask for
    "svg.hashsalt": "crcolony",
    "savefig.dpi": 250,
}
_METADATA: dict[str, dict[str, Any]] = {
    "pdf": {"CreationDate": None},
    "svg": {"Date": None},
    "png": {},
}


@contextmanager
def style() -> Iterator[None]:
    """Make figures drawn and written inside the block look the same whatever the user's matplotlib settings."""
    with matplotlib.style.context(["default", _STYLE]):
        yield


def new_figure(width_in: float, height_in: float) -> Figure:
    """Return an empty figure with constrained layout."""
    return Figure(figsize=(width_in, height_in), layout="constrained")


def band_look(line: Mapping[str, Any]) -> dict[str, Any]:
    """Return the style of the band around a line: pale, with thin edges in the line's own dashes."""
    return {
        "facecolor": to_rgba(line["color"], 0.18),
        "edgecolor": to_rgba(line["color"], 0.6),
        "linestyle": line["linestyle"],
        "linewidth": 0.4,
    }


def format_axes(axes: Axes, title: str = "", top: float = 0.0) -> None:
    """Set title, ticks and limits of axes: from 0 to just above the highest value, or above `top` if it is given."""
    axes.set_title(title)
    axes.set_ylim(0.0, _ROOM * (top or axes.dataLim.y1) or 1.0)
    axes.xaxis.set_major_locator(MaxNLocator(4, integer=True, min_n_ticks=1))
    axes.yaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]))


def write_figure(figure: Figure, path: Path) -> Path:
    """Write a figure as a whole or not at all, in the format of its suffix; return the path. Raises PlotError."""
    format_ = path.suffix.removeprefix(".")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        replace_file(
            path, lambda file: figure.savefig(file, format=format_, metadata=_METADATA[format_])
        )
    except OSError as error:
        raise PlotError(f"{path}: cannot be written: {error.strerror}") from None
    return path
