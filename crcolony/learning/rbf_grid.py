"""A normalised RBF network (eq. 2.27) on an even grid over two dimensions, at the cost of two exponentials.

With neighbours as far apart as they are wide, the response at u, counted in centres from the first, of centre i is

    exp(-(u - i)^2 / 2) = exp(-u^2 / 2) exp(u)^i exp(-i^2 / 2)

of which the first factor cancels when responses are normalised, and the last is the same for every state: one
exponential an axis gives the responses of all its centres. It is the network that `NormalizedRBF.grid` returns; a state
out of range counts as on the border, as in tile coding.
"""

from typing import NamedTuple

import numpy as np

from crcolony.compiled import FloatArray, as_index, compiled
from crcolony.learning.features import grid_axis

MOST_CENTRES = 20
"""Along an axis: with many more exp(u)^i would overflow."""


class RbfGrid(NamedTuple):
    """Axes of a grid of nx by ny centres, and room to compute in."""

    low: FloatArray
    """(2,) the first centre along each axis"""
    centres_per_unit: FloatArray
    """(2,)"""
    falloff_x: FloatArray
    """(nx,) exp(-i^2 / 2)"""
    falloff_y: FloatArray
    """(ny,) exp(-i^2 / 2)"""
    responses_y: FloatArray
    """(ny,) overwritten"""


def make_rbf_grid(low: FloatArray, high: FloatArray, counts: tuple[int, int]) -> RbfGrid:
    """Return a grid with centres evenly along [low, high] (2,), at least 2 and at most MOST_CENTRES an axis.

    Raises ValueError for other counts, and as `grid_axis` does.
    """
    if min(counts) < 2 or max(counts) > MOST_CENTRES:
        raise ValueError(f"need 2 to {MOST_CENTRES} centres along an axis, got {counts}")
    widths = [
        grid_axis(float(a), float(b), n)[1] for a, b, n in zip(low, high, counts, strict=True)
    ]
    falloff_x, falloff_y = (np.exp(-0.5 * np.arange(n, dtype=np.float64) ** 2) for n in counts)
    return RbfGrid(low.copy(), 1.0 / np.array(widths), falloff_x, falloff_y, np.zeros(counts[1]))


@compiled
def rbf_grid_value(grid: RbfGrid, state: FloatArray, weights: FloatArray) -> float:
    """Return the value at `state` (2,) with `weights` (nx * ny,), of which the index of y is the fastest."""
    responses = grid.responses_y
    growth = np.exp(_centres_from_first(grid, state, 1, responses.shape[0]))
    factor, total_y = 1.0, 0.0
    for column in range(responses.shape[0]):
        response = factor * grid.falloff_y[column]
        responses[column] = response
        total_y += response
        factor *= growth
    growth = np.exp(_centres_from_first(grid, state, 0, grid.falloff_x.shape[0]))
    factor, total_x, value = 1.0, 0.0, 0.0
    index = 0
    for row in range(grid.falloff_x.shape[0]):
        along_y = 0.0
        for column in range(responses.shape[0]):
            along_y += responses[column] * weights[as_index(index)]
            index += 1
        response = factor * grid.falloff_x[row]
        total_x += response
        value += response * along_y
        factor *= growth
    return value / (total_x * total_y)


@compiled
def _centres_from_first(grid: RbfGrid, state: FloatArray, axis: int, count: int) -> float:
    """Return where the state is along an axis, from 0 at the first centre to the last."""
    u = (state[axis] - grid.low[axis]) * grid.centres_per_unit[axis]
    return float(min(max(u, 0.0), count - 1.0))
