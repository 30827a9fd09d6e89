"""The mean of many runs by generation, and a band around it that shows its uncertainty."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from crcolony.compiled import FloatArray, IntArray

Table = Mapping[str, FloatArray]
"""The columns of a run's `generations.csv`, (generations,) each."""

MIN_RUNS = 3
"""An interval needs at least so many runs: with two, Student's t is 12.7 standard errors."""

_TWO_SIDED_95 = 0.975
"""The quantile of Student's t for a two-sided interval of 95 %."""


@dataclass(frozen=True)
class Band:
    """A quantity over the runs of a condition; all arrays are (generations,).

    `low` and `high` are the 95 % interval of the mean (Student's t) of 3 runs or more, the minimum and maximum of two
    runs, and the run itself if there is one.
    """

    generation: FloatArray
    mean: FloatArray
    low: FloatArray
    high: FloatArray
    count: IntArray
    """The number of runs that have ended this generation"""


def band_of(tables: Sequence[Table], column: str) -> Band:
    """Return the mean and the band of a column over runs.

    Only generations that at least 3 runs have ended (all runs, if there are fewer) are part of it.
    """
    generation = np.unique(np.concatenate([table["generation"] for table in tables]))
    values = np.full((len(tables), generation.size), np.nan)
    for row, table in zip(values, tables, strict=True):
        row[np.searchsorted(generation, table["generation"])] = table[column]
    count = np.isfinite(values).sum(axis=0)
    kept = count >= min(len(tables), MIN_RUNS)
    values, count = values[:, kept], count[kept]
    mean = values.sum(axis=0, where=np.isfinite(values)) / count
    if len(tables) < MIN_RUNS:
        low, high = values.min(axis=0), values.max(axis=0)
    else:
        half = half_interval(values, count)
        low, high = mean - half, mean + half
    return Band(generation[kept], mean, low, high, count)


def half_interval(values: FloatArray, count: IntArray) -> FloatArray:
    """Return half the 95 % interval of the mean of the finite values in each column of (runs, generations)."""
    from scipy.special import stdtrit  # as t.ppf of scipy.stats, which takes a second to import

    half: FloatArray = (
        stdtrit(count - 1, _TWO_SIDED_95) * np.nanstd(values, axis=0, ddof=1) / np.sqrt(count)
    )
    return half
