"""Outcomes of runs that were never made, for tests of statistics and reports."""

from dataclasses import replace
from typing import Any

import numpy as np

from crcolony.experiments.colonies.outcomes import Outcome

_MODEL = Outcome(
    condition="implicit",
    seed=1,
    matings_first=0.4,
    matings_early=2.5,
    matings_end=9.0,
    energy_weighted_matings_first=0.2,
    energy_weighted_matings_end=7.0,
    captures_first=1.0,
    captures_end=18.0,
    energy_end=0.8,
    starved_end=0.02,
    mating_share_end=0.6,
    mating_lambda_end=0.5,
    mating_tau_end=0.1,
    foraging_tau_end=0.4,
    mating_effective_tau_end=0.01,
    foraging_effective_tau_end=0.02,
    energy_effect=0.3,
    energy_effect_facing=0.1,
    energy_effect_searching=0.3,
    energy_correlation=-0.1,
    history_hash="00",
)


def outcomes_of(condition: str, runs: int, **columns: float | np.ndarray) -> list[Outcome]:
    """Return runs of a condition with seeds from 1 on; a column is one number, or one for each run."""
    outcomes = []
    for k in range(runs):
        values: dict[str, Any] = {
            name: float(np.broadcast_to(value, runs)[k]) for name, value in columns.items()
        }
        outcomes.append(replace(_MODEL, condition=condition, seed=k + 1, **values))
    return outcomes
