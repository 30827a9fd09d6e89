"""A normalised RBF network (eq. 2.27) on an even grid over two dimensions, at the cost of two exponentials.

With neighbours as far apart as they are wide, the response at u = j + d of centre j + m is

    exp(-(d - m)^2 / 2) = exp(-d^2 / 2) exp(d)^m exp(-m^2 / 2)

of which the first factor cancels when responses are normalised, and the last is the same for every state: one
exponential an axis gives the responses of all its centres. It is the network that `NormalizedRBF.grid` returns.
"""

from typing import NamedTuple

import numpy as np

from crcolony.compiled import FloatArray, compiled
from crcolony.learning.features import grid_axis


class RbfGrid(NamedTuple):
    """Axes of a grid of nx by ny centres, and room to compute in."""

    low: FloatArray
    """(2,) the first centre along each axis"""
    centres_per_unit: FloatArray
    """(2,)"""
    falloff: FloatArray
    """(max(nx, ny),) exp(-m^2 / 2)"""
    responses_x: FloatArray
    """(nx,) overwritten"""
    responses_y: FloatArray
    """(ny,) overwritten"""


def make_rbf_grid(low: FloatArray, high: FloatArray, counts: tuple[int, int]) -> RbfGrid:
    """Return a grid with centres evenly along [low, high] (2,); raises ValueError as `grid_axis` does."""
    axes = [
        grid_axis(float(a), float(b), count) for a, b, count in zip(low, high, counts, strict=True)
    ]
    steps = np.arange(max(counts), dtype=np.float64)
    return RbfGrid(
        np.array([centres[0] for centres, _ in axes]),
        np.array([1.0 / width for _, width in axes]),
        np.exp(-0.5 * steps * steps),
        np.zeros(counts[0]),
        np.zeros(counts[1]),
    )


@compiled
def rbf_grid_value(grid: RbfGrid, state: FloatArray, weights: FloatArray) -> float:
    """Return the value at `state` (2,) with `weights` (nx * ny,), of which the index of y is the fastest."""
    u = (state[0] - grid.low[0]) * grid.centres_per_unit[0]
    total = _even_responses(u, grid.falloff, grid.responses_x)
    u = (state[1] - grid.low[1]) * grid.centres_per_unit[1]
    total *= _even_responses(u, grid.falloff, grid.responses_y)
    value = 0.0
    index = 0
    for row in range(grid.responses_x.shape[0]):
        along_y = 0.0
        for column in range(grid.responses_y.shape[0]):
            along_y += grid.responses_y[column] * weights[index]
            index += 1
        value += grid.responses_x[row] * along_y
    return value / total


@compiled
def _even_responses(u: float, falloff: FloatArray, out: FloatArray) -> float:
    """Write to `out` (n,) the responses at `u`, in distances of neighbours from the first; return their sum."""
    last = out.shape[0] - 1
    nearest = int(min(max(u + 0.5, 0.0), float(last)))
    growth = np.exp(u - nearest)
    out[nearest] = 1.0
    total, factor = 1.0, 1.0
    for m in range(1, last - nearest + 1):
        factor *= growth
        response = factor * falloff[m]
        out[nearest + m] = response
        total += response
    growth, factor = 1.0 / growth, 1.0
    for m in range(1, nearest + 1):
        factor *= growth
        response = factor * falloff[m]
        out[nearest - m] = response
        total += response
    return total
