"""What came of a run: one row of numbers, read from its folder."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from crcolony.experiments.colonies.energy_effect import EnergyEffect, measure_energy_effect
from crcolony.in_process.run import read_colony
from crcolony.results.generation_table import GENERATION_TABLE, LAST_GENERATIONS, read_table
from crcolony.storage.files import FolderError

_FIRST, _EARLY, _END = slice(0, 1), slice(5, 15), slice(-LAST_GENERATIONS, None)
"""Rows of a table: generation 0, generations 5 to 14, and the last ones."""


@dataclass(frozen=True)
class Outcome:
    """The result of one run, per agent.

    `first` is generation 0, `early` the mean of generations 5 to 14, and `end` that of the last generations.

    The quantities are those of `generations.csv`; a tau is the median over agents.
    """

    condition: str
    seed: int
    matings_first: float
    matings_early: float
    """NaN if the run is too short"""
    matings_end: float
    energy_weighted_matings_first: float
    energy_weighted_matings_end: float
    captures_first: float
    captures_end: float
    energy_end: float
    starved_end: float
    mating_share_end: float
    mating_lambda_end: float
    mating_tau_end: float
    foraging_tau_end: float
    mating_effective_tau_end: float
    foraging_effective_tau_end: float
    energy_effect: float
    """Of the last population, see `energy_effect.py`"""
    energy_effect_facing: float
    energy_effect_searching: float
    energy_correlation: float
    """NaN if all choices are the same"""
    history_hash: str


def read_outcome(condition: str, folder: Path) -> Outcome:
    """Read the outcome of a finished run from its folder; raises FolderError or ConfigError if that is impossible.

    The last population lives one generation more, outside the folder, so that its choices can be examined.
    """
    description = folder / "run.json"
    if not description.exists():
        raise FolderError(
            f"{folder}: not the results of a finished run: {description.name} is missing"
        )
    energy = measure_energy_effect(read_colony(folder))
    try:
        run = json.loads(description.read_text("utf-8"))
        rows = [
            {name: float(value) for name, value in row.items()}
            for row in read_table(folder / GENERATION_TABLE)
        ]
        return outcome_of(condition, run["seed"], rows, energy, run["history_hash"])
    except (OSError, IndexError, KeyError, TypeError, ValueError) as error:
        raise FolderError(f"{folder}: not the results of a finished run: {error}") from None


def outcome_of(
    condition: str,
    seed: int,
    rows: Sequence[Mapping[str, float]],
    energy: EnergyEffect,
    history_hash: str,
) -> Outcome:
    """Return the outcome of a run from its rows by generation, and what its last population chose."""

    def mean(name: str, part: slice) -> float:
        values = [row[name] for row in rows[part]]
        return float(np.mean(values)) if values else math.nan

    return Outcome(
        condition=condition,
        seed=seed,
        matings_first=mean("matings", _FIRST),
        matings_early=mean("matings", _EARLY),
        matings_end=mean("matings", _END),
        energy_weighted_matings_first=mean("energy_weighted_matings", _FIRST),
        energy_weighted_matings_end=mean("energy_weighted_matings", _END),
        captures_first=mean("captures", _FIRST),
        captures_end=mean("captures", _END),
        energy_end=mean("energy", _END),
        starved_end=mean("starved", _END),
        mating_share_end=mean("mating_share", _END),
        mating_lambda_end=mean("mating.lambda mean", _END),
        mating_tau_end=mean("mating.tau q50", _END),
        foraging_tau_end=mean("foraging.tau q50", _END),
        mating_effective_tau_end=mean("mating.effective_tau q50", _END),
        foraging_effective_tau_end=mean("foraging.effective_tau q50", _END),
        energy_effect=energy.effect,
        energy_effect_facing=energy.effect_facing,
        energy_effect_searching=energy.effect_searching,
        energy_correlation=energy.correlation,
        history_hash=history_hash,
    )
