"""The plots of a results folder: matings, batteries, energy, meta-parameters, and the potentials of the best agents."""

import sqlite3
from pathlib import Path
from typing import Any

import numpy as np

from crcolony.colony.results import ResultsError, read_table
from crcolony.compiled import FloatArray
from crcolony.config import Config, ConfigError, load
from crcolony.errors import Refusal
from crcolony.learning.features import NormalizedRBF
from crcolony.robot.genes import META_PARAMETERS, decode
from crcolony.robot.modules import MODULES

_BLUE, _ORANGE = "#0072b2", "#d55e00"
_BEST = 3


class PlotsError(Refusal):
    """The plots cannot be drawn: the message says why."""


def draw_plots(folder: Path) -> list[Path]:
    """Draw all plots of a results folder into `folder/plots`; return the files.

    Raises PlotsError if matplotlib is missing or the folder cannot be read or written.
    """
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise PlotsError("plots need matplotlib: pip install 'crcolony[experiments]'") from None
    try:
        table = _columns(read_table(folder / "generations.csv"))
        config = load(folder / "config.toml")
        figures = {
            "generations": _draw_generations(Figure(figsize=(8, 8), layout="constrained"), table),
            "meta_parameters": _draw_meta(Figure(figsize=(13, 5), layout="constrained"), table),
            "potentials": _draw_potentials(
                Figure(figsize=(9, 8), layout="constrained"), _best_genes(folder), config
            ),
        }
        (folder / "plots").mkdir(exist_ok=True)
        for name, figure in figures.items():
            figure.savefig(folder / "plots" / f"{name}.png", dpi=110)
    except (ResultsError, ConfigError) as error:
        raise PlotsError(str(error)) from None
    except KeyError as error:
        raise PlotsError(f"{folder / 'generations.csv'}: corrupt: no column {error}") from None
    except (OSError, sqlite3.Error) as error:
        raise PlotsError(f"{folder}: {error}") from None
    return [folder / "plots" / f"{name}.png" for name in figures]


def _columns(rows: list[dict[str, str]]) -> dict[str, FloatArray]:
    if not rows:
        raise ResultsError("no generation has ended yet, there is nothing to draw")
    try:
        return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}
    except (TypeError, ValueError):
        raise ResultsError("generations.csv: corrupt: a row is not made of numbers") from None


def _best_genes(folder: Path) -> list[tuple[FloatArray, int]]:
    """Return the genes and matings of the agents that mated most in the last generation that ended."""
    database = sqlite3.connect(f"file:{folder / 'history.sqlite'}?mode=ro", uri=True)
    try:
        rows = database.execute(
            "SELECT births.genes, lives.matings FROM lives JOIN births USING (agent)"
            " WHERE lives.generation = (SELECT MAX(generation) FROM lives)"
            " ORDER BY lives.matings DESC, lives.captures DESC LIMIT ?",
            (_BEST,),
        ).fetchall()
    finally:
        database.close()
    return [(np.frombuffer(genes, dtype="<f8"), matings) for genes, matings in rows]


def _draw_generations(figure: Any, table: dict[str, FloatArray]) -> Any:
    upper, middle, lower = figure.subplots(3, 1, sharex=True)
    generation = table["generation"]
    upper.plot(generation, table["matings"], color=_ORANGE, label="matings")
    upper.plot(generation, table["conceptions"], color="0.5", label="conceptions")
    upper.set_ylabel("per agent")
    upper.set_title("Matings, and what came of them", loc="left")
    middle.plot(generation, table["captures"], color=_BLUE, label="batteries captured")
    middle.set_ylabel("per agent")
    middle.set_title("Captured batteries", loc="left")
    lower.plot(generation, table["energy"], color=_BLUE, label="mean energy while alive")
    lower.plot(generation, table["starved"], color="0.5", label="share that starved")
    lower.set_ylim(0, 1)
    lower.set_title("Energy", loc="left")
    lower.set_xlabel("generation")
    for axes in (upper, middle, lower):
        axes.set_ylim(bottom=0)
        axes.legend(frameon=False)
        axes.spines[["top", "right"]].set_visible(False)
    return figure


def _draw_meta(figure: Any, table: dict[str, FloatArray]) -> Any:
    rows = figure.subplots(len(MODULES), len(META_PARAMETERS), sharex=True, squeeze=False)
    generation = table["generation"]
    for module, axes_row, colour in zip(MODULES, rows, (_BLUE, _ORANGE), strict=False):
        for meta, axes in zip(META_PARAMETERS, axes_row, strict=True):
            name = f"{module.name}.{meta}"
            for low, high in (("q05", "q95"), ("q25", "q75")):
                axes.fill_between(
                    generation,
                    table[f"{name} {low}"],
                    table[f"{name} {high}"],
                    color=colour,
                    alpha=0.25,
                    linewidth=0,
                )
            axes.plot(generation, table[f"{name} q50"], color=colour)
            axes.set_title(name, loc="left", fontsize=10)
            axes.set_ylim(bottom=0)
            axes.spines[["top", "right"]].set_visible(False)
    for axes in rows[-1]:
        axes.set_xlabel("generation")
    figure.suptitle("Meta-parameters over all agents: median, 50 % and 90 % of them")
    return figure


def _draw_potentials(figure: Any, best: list[tuple[FloatArray, int]], config: Config) -> Any:
    range_m, half_angle = config.body.camera_range_m, config.body.camera_half_angle_rad
    distances = np.linspace(0.0, range_m, 61)
    bearings = np.linspace(-half_angle, half_angle, 61)
    counts = np.array([config.learning.potential_distances, config.learning.potential_bearings])
    network = NormalizedRBF.grid(np.zeros(2), np.array([range_m, half_angle]), counts)
    features = np.array([[network(np.array([d, abs(b)]))[1] for b in bearings] for d in distances])
    rows = figure.subplots(max(len(best), 1), len(MODULES), squeeze=False, sharex=True, sharey=True)
    for (genes, matings), axes_row in zip(best, rows, strict=True):
        agent = decode(genes, config.learning)
        for module, weights, axes in zip(MODULES, agent.potentials, axes_row, strict=True):
            picture = axes.pcolormesh(
                np.degrees(bearings), distances, features @ weights.ravel(), cmap="viridis"
            )
            axes.set_title(f"{module.name}, agent with {matings} matings", loc="left", fontsize=10)
            figure.colorbar(picture, ax=axes)
    for axes in rows[-1]:
        axes.set_xlabel("bearing (degrees)")
    for axes in rows[:, 0]:
        axes.set_ylabel("distance (m)")
    figure.suptitle("Evolved potentials of the agents that mated most")
    return figure
