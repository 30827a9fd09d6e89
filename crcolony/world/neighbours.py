"""Neighbour search: points sorted into square cells, so that a search visits only a few of them."""

import math
from typing import NamedTuple

import numpy as np

from crcolony.compiled import FloatArray, IntArray, as_index, compiled

_CELLS_PER_POINT = 4
"""There are at most so many cells for every point."""


class Cells(NamedTuple):
    """Points by their cell. The points of cell c are `order[start[c]:start[c + 1]]`."""

    grid: FloatArray
    """(3,) x and y of the lower left corner (m), cells per metre"""
    shape: IntArray
    """(2,) columns, rows"""
    start: IntArray
    """(columns * rows + 1,) index in `order` of the first point of every cell"""
    cell: IntArray
    """(points,) the cell of every point"""
    order: IntArray
    """(points,) indices of the points, cell by cell"""
    places: FloatArray
    """(points, 2) x, y (m) of the points in this order: a search reads them one after the other"""


def new_cells(width_m: float, height_m: float, cell_m: float, points: int) -> Cells:
    """Return empty cells, `cell_m` wide or more, that cover a rectangle around the origin."""
    cell_m = max(cell_m, math.sqrt(width_m * height_m / (_CELLS_PER_POINT * max(points, 1))))
    columns = max(1, int(width_m / cell_m))
    rows = max(1, int(height_m / cell_m))
    per_metre = min(columns / width_m, rows / height_m)
    return Cells(
        grid=np.array([-0.5 * width_m, -0.5 * height_m, per_metre]),
        shape=np.array([columns, rows]),
        start=np.zeros(columns * rows + 1, dtype=np.int64),
        cell=np.zeros(points, dtype=np.int64),
        order=np.zeros(points, dtype=np.int64),
        places=np.zeros((points, 2)),
    )


@compiled
def _cell_along(position: float, corner: float, per_metre: float, cells: int) -> int:
    return min(max(int((position - corner) * per_metre), 0), cells - 1)


@compiled
def sort_into_cells(cells: Cells, positions: FloatArray) -> None:
    """Sort points (points, 2 or more columns: x, y in m) into their cells, in the order of their
    index."""
    columns, rows = cells.shape[0], cells.shape[1]
    start, cell = cells.start, cells.cell
    start[:] = 0
    for i in range(positions.shape[0]):
        column = _cell_along(positions[i, 0], cells.grid[0], cells.grid[2], columns)
        row = _cell_along(positions[i, 1], cells.grid[1], cells.grid[2], rows)
        cell[i] = row * columns + column
        start[as_index(cell[i] + 1)] += 1
    for c in range(columns * rows):
        start[c + 1] += start[c]
    for i in range(positions.shape[0] - 1, -1, -1):
        start[as_index(cell[i] + 1)] -= 1
        place = as_index(start[as_index(cell[i] + 1)])
        cells.order[place] = i
        cells.places[place, 0] = positions[i, 0]
        cells.places[place, 1] = positions[i, 1]
    for c in range(columns * rows):
        start[c] = start[c + 1]
    start[columns * rows] = positions.shape[0]


@compiled
def collect_near(cells: Cells, x: float, y: float, range_m: float, found: FloatArray) -> int:
    """Write the points within `range_m` of x, y (m) to the rows of `found` (most, 4 or more); return
    how many.

    A row begins with the index of a point, its distance along x and along y (m), and its squared
    distance (m^2). Points beyond the length of `found` are left out.
    """
    corner_x, corner_y, per_metre = cells.grid[0], cells.grid[1], cells.grid[2]
    columns, rows = cells.shape[0], cells.shape[1]
    left = _cell_along(x - range_m, corner_x, per_metre, columns)
    right = _cell_along(x + range_m, corner_x, per_metre, columns)
    lowest = _cell_along(y - range_m, corner_y, per_metre, rows)
    highest = _cell_along(y + range_m, corner_y, per_metre, rows)
    count = 0
    for row in range(lowest, highest + 1):
        first = as_index(cells.start[as_index(row * columns + left)])
        end = as_index(cells.start[as_index(row * columns + right + 1)])
        for k in range(first, end):
            if count == found.shape[0]:
                return count
            dx = cells.places[k, 0] - x
            dy = cells.places[k, 1] - y
            squared = dx * dx + dy * dy
            # Every point is written, and the next one over it if it is too far: whether a point is
            # near cannot be predicted, and a processor that guesses wrongly loses more than a write.
            found[count, 0] = cells.order[k]
            found[count, 1] = dx
            found[count, 2] = dy
            found[count, 3] = squared
            count += 1 if squared <= range_m * range_m else 0
    return count
