"""Which meta-parameters have evolved further than a neutral gene drifts."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from crcolony.config import load
from crcolony.results.generation_summary import quantile_name
from crcolony.results.generation_table import GENERATION_TABLE, LAST_GENERATIONS, read_table
from crcolony.results.neutral_gene import QUANTILES, neutral_medians
from crcolony.results.pedigree import read_pedigree
from crcolony.robot.genes import META_PARAMETERS
from crcolony.robot.modules import MODULES


@dataclass(frozen=True)
class Drift:
    """A meta-parameter at the end of the runs of a condition, beside neutral genes: means over runs of medians."""

    condition: str
    gene: str
    evolved: float
    neutral_low: float
    neutral_high: float
    """90 % of the neutral genes, passed on along the pedigrees of these runs, end between these"""

    @property
    def is_outside(self) -> bool:
        """Whether chance alone rarely leads so far."""
        return not self.neutral_low <= self.evolved <= self.neutral_high


def measure_drift(condition: str, folders: Sequence[Path]) -> list[Drift]:
    """Return all meta-parameters of the finished runs in these folders; raises FolderError or ConfigError."""
    genes = [f"{module.name}.{meta}" for module in MODULES for meta in META_PARAMETERS]
    evolved: dict[str, list[float]] = {gene: [] for gene in genes}
    neutral: dict[str, list[np.ndarray]] = {gene: [] for gene in genes}
    for folder in folders:
        rows = read_table(folder / GENERATION_TABLE)[-LAST_GENERATIONS:]
        generations = [int(row["generation"]) for row in rows]
        medians = neutral_medians(read_pedigree(folder), load(folder / "config.toml"), genes)
        for gene in genes:
            column = quantile_name(gene, 0.5)
            evolved[gene].append(float(np.mean([float(row[column]) for row in rows])))
            neutral[gene].append(medians[gene][generations].mean(axis=0))
    drifts = []
    for gene in genes:
        low, high = np.quantile(np.mean(neutral[gene], axis=0), QUANTILES)
        drifts.append(
            Drift(condition, gene, float(np.mean(evolved[gene])), float(low), float(high))
        )
    return drifts
