"""The band in which a neutral gene would lie: what is drawn behind the curve of each meta-parameter."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.results.neutral_gene import QUANTILES, REPLICATES, neutral_medians
from crcolony.results.pedigree import read_pedigree
from crcolony.results.plots.conditions import Condition
from crcolony.storage.files import FolderError


@dataclass(frozen=True)
class NeutralBand:
    """Between which values 90 % of neutral genes lie, as medians over agents and means over runs; (generations,)."""

    generation: FloatArray
    low: FloatArray
    high: FloatArray


def neutral_bands(condition: Condition, genes: Sequence[str]) -> dict[str, NeutralBand]:
    """Return the bands of neutral genes beside some genes, by name.

    There are none where a pedigree cannot be read: where agents came from another colony, or are too many.
    """
    generation = condition.band("matings").generation
    sums = {gene: np.zeros((generation.size, REPLICATES)) for gene in genes}
    counts = np.zeros(generation.size)
    for run in condition.runs:
        try:
            pedigree = read_pedigree(run.folder)
        except FolderError:
            return {}
        drawn = np.isin(generation, run.table["generation"])
        counts += drawn
        for gene, medians in neutral_medians(pedigree, run.config, genes).items():
            sums[gene][drawn] += medians[generation[drawn].astype(int)]
    bands = {}
    for gene, total in sums.items():
        low, high = np.quantile(total / counts[:, None], QUANTILES, axis=1)
        bands[gene] = NeutralBand(generation, low, high)
    return bands
