"""The figure of the mountain car: learning curves, genes by generation, and the potential of the best run."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.experiments.framework.experiment import CONDITION, SEED, Row
from crcolony.experiments.framework.quartile_curve import draw_quartiles, quartiles_of
from crcolony.experiments.mountain_car_claims import BOTH, META_ALONE, OMPAC, TEXTBOOK
from crcolony.experiments.worlds.mountain_car_genes import CENTRES, HIGH, LOW, WEIGHTS
from crcolony.learning.features import NormalizedRBF

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_POINTS = 60
"""Points of the picture of a potential along each axis."""


def draw(rows: Sequence[Row]) -> "Figure":
    """Draw medians over seeds with the middle half, and a picture of a potential."""
    from crcolony.results.plots.style import LINES, PAGE_IN, new_figure

    figure = new_figure(PAGE_IN, 2.6)
    curves, genes, picture = figure.subplots(1, 3)
    for (label, column, condition), line in zip(
        (
            ("evolved", "steps", BOTH),
            ("best founder", "founder_steps", BOTH),
            ("meta-parameters alone", "steps", META_ALONE),
            ("textbook", "steps", TEXTBOOK),
            ("OMPAC, as it learns", "steps", OMPAC),
        ),
        LINES,
        strict=False,
    ):
        draw_quartiles(curves, *quartiles_of(rows, condition, "episode", column), label, line)
    curves.set(xlabel="episode", ylabel="steps", xscale="log", yscale="log", ylim=(80.0, 6_000.0))
    curves.legend(loc="upper right")
    for (label, column, scale), line in zip(
        (("λ", "lambda_mean", 1.0), ("α / 2", "alpha_mean", 2.0), ("τ / 5", "temperature", 5.0)),
        LINES,
        strict=False,
    ):
        generations, quartiles = quartiles_of(rows, BOTH, "generation", column)
        draw_quartiles(genes, generations, quartiles / scale, label, line)
    genes.set(xlabel="generation", ylabel="gene over its highest value", ylim=(0.0, 1.0))
    genes.legend()
    _draw_potential(picture, rows)
    return figure


def _draw_potential(axes: "Axes", rows: Sequence[Row]) -> None:
    """Draw the potential of the run whose learner was best when it was chosen."""
    chosen = [row for row in rows if row[CONDITION] == BOTH and "chosen_steps" in row]
    best = min(chosen, key=lambda row: float(row["chosen_steps"]))
    weights = np.array([best[f"potential_{k}"] for k in range(WEIGHTS)], dtype=np.float64)
    positions, speeds, values = potential_image(weights)
    image = axes.pcolormesh(positions, speeds, values.T, cmap="viridis", rasterized=True)
    axes.set(xlabel="position", ylabel="velocity", title=f"potential, seed {best[SEED]}")
    axes.figure.colorbar(image, ax=axes)


def potential_image(weights: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return positions (p,), velocities (q,), and the potential (p, q) at them, from its weights."""
    network = NormalizedRBF.grid(LOW, HIGH, np.array(CENTRES))
    positions, speeds = (np.linspace(a, b, _POINTS) for a, b in zip(LOW, HIGH, strict=True))
    values = [
        [float(np.dot(network(np.array([x, v]))[1], weights)) for v in speeds] for x in positions
    ]
    return positions, speeds, np.array(values)
