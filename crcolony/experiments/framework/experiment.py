"""What an experiment is: jobs that give rows of numbers, how each of its claims is measured from them, and a figure.

An experiment NAME is a file `crcolony/experiments/NAME.py` (with `_` for `-`) that defines `EXPERIMENT`, and
`crcolony/experiments/claims/NAME.toml`, in which its claims stand before anything has run (see `registration.py`).
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import msgspec
import numpy as np

from crcolony.compiled import FloatArray
from crcolony.experiments.framework.registration import Claim

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Value = int | float | str
"""What stands in a table: a number, NaN where there is none, or a word."""
Row = dict[str, Value]
"""One row of a table; a column that does not concern it is left out."""
Verdict = Literal["reproduced", "partly", "not"]

CONDITION, SEED = "condition", "seed"
"""The columns that every row has."""


@dataclass(frozen=True)
class Column:
    """What a column of the rows means, for those who read the data alone."""

    meaning: str
    unit: str = ""
    """SI, or what is counted; empty: a pure number or a word"""


@dataclass(frozen=True)
class Plan:
    """What is asked of an experiment."""

    seeds: Sequence[int]
    is_quick: bool = False
    """Whether jobs are to take a moment and show only that they run: their results are never claims"""


@dataclass(frozen=True)
class Job:
    """One run of a condition: a function that gives the same rows wherever it is called."""

    condition: str
    seed: int
    run: Callable[[], Row | Sequence[Row]]
    """At least one row. It is sent to other processes: a `functools.partial` of a function of a module. It reads no
    clock and no file, takes its randomness from the seed, and installs no handler of signals"""


class Measured(msgspec.Struct, frozen=True, kw_only=True):
    """What was measured of a claim; NaN where there is none."""

    estimate: float
    low: float = math.nan
    high: float = math.nan
    """The 95 % interval of the estimate"""
    statistic: str
    """The test and its numbers, for people"""
    p: float = math.nan
    """Of the null hypothesis, which is that the claim does not hold"""
    effect: str = ""
    """What the effect size is, as in A12"""
    effect_size: float = math.nan
    runs: int
    verdict: Verdict


@dataclass(frozen=True)
class Experiment:
    """A result that one command reproduces."""

    name: str
    columns: Mapping[str, Column]
    """Of all rows, but for condition and seed"""
    jobs: Callable[[Plan], Sequence[Job]]
    """No two of the same condition and seed; a condition has the same jobs however many seeds there are"""
    measures: Mapping[str, Callable[[Claim, Sequence[Row]], Measured]]
    """By the id of each claim, how it is measured from all rows"""
    draw: Callable[[Sequence[Row]], "Figure"]
    """Draws all rows; matplotlib is imported in it"""


def verdict_of(is_met: bool, is_partly: bool = False) -> Verdict:
    """Return the verdict of a claim that is met, met in part, or neither."""
    return "reproduced" if is_met else "partly" if is_partly else "not"


def values_of(rows: Sequence[Row], column: str, condition: str) -> FloatArray:
    """Return a column of a condition, in the order of seeds; rows without it are left out.

    Raises KeyError if no row has it.
    """
    own = [row for row in rows if row[CONDITION] == condition and column in row]
    if not own:
        raise KeyError(f"{column} of {condition}")
    own.sort(key=lambda row: row[SEED])
    return np.array([row[column] for row in own], dtype=np.float64)


def pairs_of(
    rows: Sequence[Row], column: str, one: str, other: str
) -> tuple[FloatArray, FloatArray]:
    """Return a column of two conditions, (pairs,) each, where both have a row of the same seed.

    Raises KeyError if there is no pair.
    """
    by_seed = [
        {row[SEED]: row[column] for row in rows if row[CONDITION] == condition and column in row}
        for condition in (one, other)
    ]
    seeds = sorted(by_seed[0].keys() & by_seed[1].keys())
    if not seeds:
        raise KeyError(f"{column} of {one} and {other}")
    first, second = (
        np.array([values[seed] for seed in seeds], dtype=np.float64) for values in by_seed
    )
    return first, second
