"""The potentials that evolved: for one run those of its best agents, for many the mean over all agents."""

import sqlite3
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.ticker import MaxNLocator

from crcolony.compiled import FloatArray
from crcolony.config import Config
from crcolony.learning.features import NormalizedRBF
from crcolony.results.history_database import HISTORY_DATABASE
from crcolony.results.plots.conditions import Condition, PlotError, Run
from crcolony.results.plots.style import COLUMN_IN, new_figure
from crcolony.robot.genes import agent_schema, decode
from crcolony.robot.modules import MODULES
from crcolony.storage.sql import connect_read_only

_BEST = 3
"""Agents of one run whose potentials are drawn."""
_POINTS = 61
"""Of a field, along each axis."""
_LEVELS = 6
"""Contour lines of a field, at most."""
_IMAGE: dict[str, Any] = {"cmap": "cividis", "interpolation": "bilinear"}


@dataclass(frozen=True)
class _Row:
    """Genes whose potentials, one for each module, are drawn side by side."""

    label: str
    genes: FloatArray
    config: Config


def draw_potentials(conditions: Sequence[Condition]) -> Figure:
    """Draw a potential for each module; raises PlotError if a history cannot be read."""
    runs = [run for condition in conditions for run in condition.runs]
    if len(runs) == 1:
        return _draw("Potentials of the agents that mated most", _best_of(runs[0]))
    means = [_mean_of(condition) for condition in _shaped(conditions)]
    return _draw("Mean potentials of the last generation's agents", means)


def _shaped(conditions: Sequence[Condition]) -> Sequence[Condition]:
    """Leave out the conditions without shaping, whose potentials are flat, unless there are no others."""
    return [
        condition for condition in conditions if condition.config.learning.shaping
    ] or conditions


def _best_of(run: Run) -> list[_Row]:
    """Return the agents that mated most in the last generation that has ended."""
    agents = _read_agents(run, int(run.table["generation"][-1]))[:_BEST]
    return [
        _Row(f"agent with {matings} mating{'s' * (matings != 1)}", genes, run.config)
        for genes, matings in agents
    ]


def _mean_of(condition: Condition) -> _Row:
    """Return the mean over runs of the mean over all agents of the last generation that is drawn.

    A potential is linear in its genes: that of the mean genes is the mean potential.
    """
    last = condition.band("matings").generation[-1]
    runs = [run for run in condition.runs if last in run.table["generation"]]
    means = [np.mean([genes for genes, _ in _read_agents(run, int(last))], axis=0) for run in runs]
    return _Row(condition.label, np.mean(means, axis=0), condition.config)


def _read_agents(run: Run, generation: int) -> list[tuple[FloatArray, int]]:
    """Return genes and matings of a generation's agents, most matings first; raises PlotError."""
    path = run.folder / HISTORY_DATABASE
    size = len(agent_schema(run.config.learning, run.config.heredity).genes)
    try:
        with closing(connect_read_only(path)) as database:
            rows = database.execute(
                "SELECT births.genes, lives.matings FROM lives JOIN births USING (agent)"
                " WHERE lives.generation = ? ORDER BY lives.matings DESC, lives.captures DESC, agent",
                (generation,),
            ).fetchall()
        agents = [(np.frombuffer(genes, dtype="<f8"), int(matings)) for genes, matings in rows]
    except (sqlite3.Error, TypeError, ValueError) as error:
        raise PlotError(f"{path}: {error}") from None
    if not agents or any(genes.size != size for genes, _ in agents):
        raise PlotError(f"{path}: corrupt: no agents of generation {generation} with {size} genes")
    return agents


def _draw(title: str, rows: Sequence[_Row]) -> Figure:
    """Draw a row of fields for each entry, with one colour scale for all fields of a module."""
    figure = new_figure(COLUMN_IN, 0.9 + 1.25 * len(rows))
    grid = figure.subplots(len(rows), len(MODULES), squeeze=False, sharex=True, sharey=True)
    fields = [_fields(row) for row in rows]
    for m, module in enumerate(MODULES):
        low = min(float(field[m].min()) for field in fields)
        high = max(float(field[m].max()) for field in fields)
        for row, axes, field in zip(rows, grid[:, m], fields, strict=True):
            image = _draw_field(axes, field[m], row.config, low, high)
        scale = figure.colorbar(
            image,
            ax=list(grid[:, m]),
            location="top",
            aspect=25,
            pad=0.06 / len(rows),
            ticks=MaxNLocator(3, steps=[1, 2, 5, 10]),
        )
        scale.set_label(f"Φ of {module.name}")
        grid[-1, m].set_xlabel("bearing (°)")
    for row, axes in zip(rows, grid[:, 0], strict=True):
        axes.set_title(row.label)
        axes.set_ylabel("distance (m)")
    corners = [
        _corner(row.config) for row in rows
    ]  # conditions may have cameras of different range
    half_deg, range_m = np.max(corners, axis=0)
    axes.set(xlim=(-half_deg, half_deg), ylim=(0.0, range_m))
    figure.suptitle(title, x=0.02, ha="left")
    return figure


def _fields(row: _Row) -> list[FloatArray]:
    """Return each module's potential, (distances, bearings), over the camera's whole field of view."""
    body, learning = row.config.body, row.config.learning
    corner = np.array([body.camera_range_m, body.camera_half_angle_rad])
    counts = np.array([learning.potential_distances, learning.potential_bearings])
    network = NormalizedRBF.grid(np.zeros(2), corner, counts)
    distances = np.linspace(0.0, corner[0], _POINTS)
    bearings = np.abs(np.linspace(-corner[1], corner[1], _POINTS))
    features = np.array([[network(np.array([d, b]))[1] for b in bearings] for d in distances])
    return [features @ weights.ravel() for weights in decode(row.genes, learning).potentials]


def _draw_field(
    axes: Axes, field: FloatArray, config: Config, low: float, high: float
) -> AxesImage:
    """Draw a potential as an image with contour lines, which can be read without colours."""
    half_deg, range_m = _corner(config)
    extent = (-half_deg, half_deg, 0.0, range_m)
    image = axes.imshow(
        field, origin="lower", extent=extent, aspect="auto", vmin=low, vmax=high, **_IMAGE
    )
    levels = np.linspace(low, high, _LEVELS + 2)
    levels = levels[(levels > field.min()) & (levels < field.max())]
    if levels.size:  # a field that is flat has no lines of equal height
        axes.contour(field, levels, extent=extent, colors="white", linewidths=0.4)
    return image


def _corner(config: Config) -> tuple[float, float]:
    """Return the half angle (degrees) and the range (m) of a camera."""
    return float(np.degrees(config.body.camera_half_angle_rad)), config.body.camera_range_m
