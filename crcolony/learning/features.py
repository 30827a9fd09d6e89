"""Features phi_s of a state: tile coding (section 2.7) and normalised RBF networks (eq. 2.27).

A feature map returns the features that are not zero, as their indices and their values: N of n for
N tilings, where every value is 1, and all n for an RBF network. A linear value function (eq. 2.19)
is then the sum of a few products, and by eq. 2.20 the values are also its gradient.
"""

import math
from dataclasses import dataclass
from typing import Protocol, Self

import numpy as np

from crcolony.compiled import FloatArray, IntArray, compiled


class FeatureMap(Protocol):
    """Maps a state to the features of a linear value function."""

    @property
    def size(self) -> int:
        """The number n of features."""

    def __call__(self, state: FloatArray) -> tuple[IntArray, FloatArray]:
        """Return the indices and the values of the features of `state` (d,) that are not zero."""


@compiled
def tile_indices(
    state: FloatArray,
    low: FloatArray,
    tiles_per_unit: FloatArray,
    tiles: IntArray,
    offsets: FloatArray,
    out: IntArray,
) -> None:
    """Write to `out` (tilings,) the active tile of each tiling, in [0, tilings * prod(tiles + 1)).

    `tiles` (d,) are the tiles along each axis from `low` (d,), with `tiles_per_unit` (d,); tiling k
    is displaced by row k of `offsets` (tilings, d), in fractions of a tile, so one tile more is
    needed to cover the range. A state (d,) out of range counts as on the border.
    """
    for tiling in range(out.shape[0]):
        out[tiling] = tiling
    for axis in range(tiles.shape[0]):
        count = tiles[axis]
        position = (state[axis] - low[axis]) * tiles_per_unit[axis]
        if not position > 0.0:  # NaN counts as on the border, too
            position = 0.0
        elif position > count:
            position = float(count)
        for tiling in range(out.shape[0]):
            cell = min(int(position + offsets[tiling, axis]), count)
            out[tiling] = out[tiling] * (count + 1) + cell


def uniform_offsets(tilings: int, dimensions: int) -> FloatArray:
    """Return displacements (tilings, d): odd multiples 1, 3, 5, ... of 1 / tilings of a tile.

    Each axis has its own multiple (Parks and Militzer 1991), so that tilings do not line up along
    the diagonal. Raises ValueError for fewer than one tiling or dimension.
    """
    if tilings < 1 or dimensions < 1:
        raise ValueError(f"need a tiling and a dimension, got {tilings} and {dimensions}")
    multiples = np.outer(np.arange(tilings), 2 * np.arange(dimensions) + 1)
    return np.asarray((multiples % tilings) / tilings, dtype=np.float64)


def distinct_offsets(tilings: int, axis: int) -> int:
    """Return how many different displacements `uniform_offsets` has along an axis (0 is the first).

    It is `tilings` unless they share a factor with the axis' multiple: 6 tilings are displaced by
    only 2 different offsets along the second axis, and tell apart a third of the states there.
    """
    return tilings // math.gcd(2 * axis + 1, tilings)


@dataclass(frozen=True, eq=False)
class TileCoding:
    """N grid tilings over a box, each displaced: N active tiles of n (section 2.7).

    `low`, `high` and `tiles` are (d,), `offsets` is (tilings, d) in fractions of a tile. Raises
    ValueError for an empty box, fewer than one tile along an axis, offsets outside [0, 1) or
    shapes that disagree.
    """

    low: FloatArray
    high: FloatArray
    tiles: IntArray
    offsets: FloatArray

    def __post_init__(self) -> None:
        if not self.low.shape == self.high.shape == self.tiles.shape == self.offsets.shape[1:]:
            raise ValueError("low, high, tiles and an offset need one number for each dimension")
        if not np.all(self.low < self.high):
            raise ValueError(f"the box is empty: low {self.low}, high {self.high}")
        if np.any(self.tiles < 1):
            raise ValueError(f"every dimension needs a tile, got {self.tiles}")
        if np.any((self.offsets < 0.0) | (self.offsets >= 1.0)):
            raise ValueError("offsets are fractions of a tile, in [0, 1)")

    @property
    def size(self) -> int:
        """The number n of tiles in all tilings."""
        return self.active * int(np.prod(self.tiles + 1))

    @property
    def tiles_per_unit(self) -> FloatArray:
        """The tiles (d,) along a unit of each axis."""
        return np.asarray(self.tiles / (self.high - self.low), dtype=np.float64)

    @property
    def active(self) -> int:
        """The number N of tilings, and so of active tiles."""
        return int(self.offsets.shape[0])

    def __call__(self, state: FloatArray) -> tuple[IntArray, FloatArray]:
        """Return the active tiles of `state` (d,) and a value of 1 for each.

        Raises ValueError for a state of another shape.
        """
        if state.shape != self.low.shape:
            raise ValueError(f"a state of shape {self.low.shape} is needed, got {state.shape}")
        indices = np.empty(self.active, dtype=np.int64)
        tile_indices(state, self.low, self.tiles_per_unit, self.tiles, self.offsets, indices)
        return indices, np.ones(self.active)


@dataclass(frozen=True, eq=False)
class NormalizedRBF:
    """A normalised radial basis function network (eq. 2.27).

    `centres` are (n, d). `widths` are (n,), or (n, d) where the axes differ in units. Raises
    ValueError for widths that are not positive or shapes that disagree.
    """

    centres: FloatArray
    widths: FloatArray

    def __post_init__(self) -> None:
        if self.widths.shape not in (self.centres.shape[:1], self.centres.shape):
            raise ValueError(
                f"{self.centres.shape[0]} centres do not fit widths {self.widths.shape}"
            )
        if not np.all(self.widths > 0.0):
            raise ValueError("widths are positive")

    @classmethod
    def grid(cls, low: FloatArray, high: FloatArray, counts: IntArray) -> Self:
        """Return a network with centres on a grid over [low, high] (d,), `counts` (d,) an axis.

        The last axis is the fastest. Raises ValueError as `grid_axis` does.
        """
        axes = [grid_axis(*axis) for axis in zip(low, high, counts, strict=True)]
        mesh = np.meshgrid(*(centres for centres, _ in axes), indexing="ij")
        centres = np.stack([coordinate.ravel() for coordinate in mesh], axis=1)
        return cls(centres, np.tile([width for _, width in axes], (centres.shape[0], 1)))

    @property
    def size(self) -> int:
        """The number n of basis functions."""
        return int(self.centres.shape[0])

    def __call__(self, state: FloatArray) -> tuple[IntArray, FloatArray]:
        """Return all features of `state` (d,): not negative, with a sum of 1, however far it is."""
        distances = (state - self.centres) / self.widths.reshape(self.size, -1)
        exponents = 0.5 * np.sum(distances**2, axis=1)
        responses = np.exp(
            exponents.min() - exponents
        )  # the nearest responds with 1, so the sum is not 0
        return np.arange(self.size), responses / responses.sum()


def grid_axis(low: float, high: float, count: int) -> tuple[FloatArray, float]:
    """Return centres (count,) evenly along [low, high], and a width: the distance of neighbours.

    Raises ValueError for an empty range or no centre.
    """
    if not low < high or count < 1:
        raise ValueError(f"need low < high and a centre, got {low}, {high} and {count}")
    if count == 1:
        return np.array([(low + high) / 2.0]), float(high - low)
    return np.linspace(low, high, count), float((high - low) / (count - 1))


@compiled
def axis_responses(x: float, centres: FloatArray, width: float, out: FloatArray) -> float:
    """Write to `out` (n,) the Gaussian responses to `x`, the largest being 1; return their sum."""
    scale = 0.5 / (width * width)
    smallest = np.inf
    for index in range(centres.shape[0]):
        distance = x - centres[index]
        out[index] = scale * distance * distance
        smallest = min(smallest, out[index])
    total = 0.0
    for index in range(centres.shape[0]):
        out[index] = np.exp(smallest - out[index])
        total += out[index]
    return total


@compiled
def grid_rbf_value(
    x: float,
    y: float,
    centres_x: FloatArray,
    width_x: float,
    centres_y: FloatArray,
    width_y: float,
    weights_xy: FloatArray,
    scratch_x: FloatArray,
    scratch_y: FloatArray,
) -> float:
    """Return the value at (x, y) of a normalised RBF grid (eq. 2.27) with `weights_xy` (nx * ny,).

    The index of y is the fastest; `scratch_x` (nx,) and `scratch_y` (ny,) are overwritten.
    """
    # exp(-(dx^2 + dy^2)) = exp(-dx^2) exp(-dy^2), and the sum over a grid of products is the
    # product of the sums over its axes: nx + ny exponentials instead of nx * ny. The largest
    # response cancels in the quotient.
    total = axis_responses(x, centres_x, width_x, scratch_x)
    total *= axis_responses(y, centres_y, width_y, scratch_y)
    value = 0.0
    index = 0
    for row in range(centres_x.shape[0]):
        along_y = 0.0
        for column in range(centres_y.shape[0]):
            along_y += scratch_y[column] * weights_xy[index]
            index += 1
        value += scratch_x[row] * along_y
    return value / total
