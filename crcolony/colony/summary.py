"""A generation in numbers: what its agents did, and how their meta-parameters are distributed."""

from collections.abc import Sequence

import numpy as np

from crcolony.robot.genes import META_PARAMETERS
from crcolony.robot.modules import MODULES
from crcolony.robot.robot import Robot
from crcolony.robot.state import Robots

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)


def summarise(
    generation: int, tick: int, batch: Robots, robots: Sequence[Robot]
) -> dict[str, float]:
    """Return means over all agents of all robots, taken before the turnover.

    Matings, captures and conceptions are per agent; energy is the mean over the steps lived; starved is the share
    of agents that died; `foraging.alpha q50` and the like are quantiles of a gene over all agents.
    """
    lived = np.maximum(batch.lived, 1)
    agents = batch.matings.size
    row: dict[str, float] = {
        "generation": generation,
        "tick": tick,
        "matings": float(batch.matings.mean()),
        "captures": float(batch.captures.mean()),
        "conceptions": sum(robot.subpopulation.conceived for robot in robots) / agents,
        "energy": float((batch.felt / lived).mean()),
        "lived_steps": float(batch.lived.mean()),
        "starved": float((batch.energies <= 0.0).mean()),
        "mating_share": float(batch.used[:, :, -1].sum() / max(batch.used.sum(), 1)),
    }
    schema = robots[0].subpopulation.schema
    for module in MODULES:
        for meta in META_PARAMETERS:
            name = f"{module.name}.{meta}"
            values = batch.genotypes[:, :, schema.index(name)]
            row[f"{name} mean"] = float(values.mean())
            for quantile, value in zip(QUANTILES, np.quantile(values, QUANTILES), strict=True):
                row[quantile_of(name, quantile)] = float(value)
    return row


def quantile_of(gene: str, share: float) -> str:
    """Name the column of a gene's quantile over agents."""
    return f"{gene} q{round(100 * share):02d}"
